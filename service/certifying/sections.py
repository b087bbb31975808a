"""Sections of a certificate: HTML without style or script."""

from __future__ import annotations

import html
from statistics import fmean, pstdev

from service.certifying.certificate import Certificate
from service.certifying.gauge_file import CornersEntry, LengthEntry, PlateFile
from service.certifying.tables import HASH_SHOWN, facts, in_mm, table
from service.certifying.words import detail, millimetres, plain, words
from service.reasons import Language


def results(language: Language, certificate: Certificate) -> str:
    """The limit, what was measured against it, and what the test is sure of."""
    limit, errors = certificate.told.limit, [error.error_mm for error in certificate.lengths]
    form = certificate.worst_form
    kind = "limit_grows" if limit.per_m_mm else "limit_value"
    stated = words(language, kind, limit=plain(language, limit.constant_mm), per_m=plain(language, limit.per_m_mm))
    largest = max(errors, key=abs)
    told = words(
        language,
        "form_value",
        form=millimetres(language, form.form_mm),
        line=form.line,
        picture=form.picture,
        own=plain(language, form.uncertainty_mm),
        limit=plain(language, form.limit_mm),
    )
    plate = isinstance(certificate.gauge.file, PlateFile)
    rows = [
        (words(language, "limit"), words(language, f"by_{certificate.told.limit_by}", limit=stated)),
        (words(language, "range"), _range(language, certificate)),
        (words(language, "largest"), in_mm(language, millimetres(language, largest, signed=True))),
        (
            words(language, "mean"),
            in_mm(
                language,
                f"{millimetres(language, fmean(errors), signed=True)}, {millimetres(language, pstdev(errors))}",
            ),
        ),
        (words(language, "form" if plate else "form_block"), told),
        (words(language, "plane"), _plane(language, certificate)),
        (words(language, "unsure"), in_mm(language, f"±{millimetres(language, certificate.uncertainty_mm)}")),
        (words(language, "own"), _own(language, certificate)),
        (words(language, "marks"), _marks(language, certificate)),
    ]
    return facts(rows)


def _range(language: Language, certificate: Certificate) -> str:
    true = [error.true_mm for error in certificate.lengths]
    least, most = plain(language, round(min(true), 1)), plain(language, round(max(true), 1))
    height, places = plain(language, certificate.gauge.file.height_mm), len(certificate.kept)
    return words(language, "range_value", least=least, most=most, height=height, places=places)


def _plane(language: Language, certificate: Certificate) -> str:
    worst = certificate.worst_plane
    if worst is None:
        return words(language, "plane_none")
    off, limit = millimetres(language, worst.off_mm, 2, signed=True), millimetres(language, worst.limit_mm, 2)
    return words(language, "plane_value", off=off, picture=worst.picture, limit=limit)


def _own(language: Language, certificate: Certificate) -> str:
    figure, count = certificate.own_figure_mm, certificate.within_own_figure
    if figure is None or count is None:
        return words(language, "own_none")
    return words(language, "own_value", figure=millimetres(language, figure), count=count, all=len(certificate.lengths))


def _marks(language: Language, certificate: Certificate) -> str:
    if certificate.record.sentinels is None:
        return words(language, "marks_none")
    offset = certificate.marks_px
    if offset is None:
        return words(language, "marks_hidden")
    tolerance = plain(language, certificate.told.marks_tolerance_px)
    return words(language, "marks_value", offset=millimetres(language, offset, 2), tolerance=tolerance)


def tested(language: Language, certificate: Certificate) -> str:
    """Cell, camera, calibration and program."""
    told, record = certificate.told, certificate.record
    calibration = record.calibration
    made = "–" if record.created is None else f"{record.created:%Y-%m-%d %H:%M %z}"
    frame = words(language, "unaligned")
    if calibration.alignment is not None:
        x, y = calibration.alignment.translation_mm
        turn = millimetres(language, calibration.alignment.rotation_deg)
        place = {"x": millimetres(language, x, 2), "y": millimetres(language, y, 2)}
        frame = words(language, "aligned", turn=turn, **place)
    rows = [
        (words(language, "cell"), told.cell or "–"),
        (words(language, "camera"), record.camera_name or "–"),
        (words(language, "picture"), f"{calibration.image_width} x {calibration.image_height} px"),
        (words(language, "calibration"), f"{told.calibration_file}, {made}"),
        (words(language, "hash"), record.digest),
        (words(language, "alignment"), frame),
        (words(language, "program"), f"combtrace {told.version}"),
    ]
    if told.recipe:
        rows.insert(-1, (words(language, "recipe"), told.recipe))
    return facts(rows)


def gauge(language: Language, certificate: Certificate) -> str:
    """What it is, and its lengths."""
    file = certificate.gauge.file
    by_on = words(language, "by_on", by=file.calibrated_by, on=file.calibrated_on)
    height = words(
        language, "plus", value=plain(language, file.height_mm), unsure=plain(language, file.height_uncertainty_mm)
    )
    rows = [
        (words(language, "gauge_id"), f"{file.id}, {words(language, file.kind)}"),
        (words(language, "calibrated"), by_on),
        (words(language, "height"), height),
        (words(language, "own_form"), in_mm(language, plain(language, file.form_mm))),
        (words(language, "warmth"), _warmth(language, certificate)),
        (words(language, "file_hash"), certificate.gauge.digest),
    ]
    if isinstance(file, PlateFile):
        board = file.board.board()
        told = {"squares": board.name_of_size, "square": plain(language, board.square_mm)}
        rows.insert(
            2,
            (
                words(language, "board"),
                words(language, "board_value", kind=board.kind, **told, dictionary=board.dictionary or "–"),
            ),
        )
    head = [words(language, key) for key in ("name", "between", "calibrated_mm", "u_mm")]
    lengths = [
        [one.name, _between(language, one), plain(language, one.length_mm), plain(language, one.uncertainty_mm)]
        for one in file.lengths
    ]
    return facts(rows) + table(head, lengths, (2, 3))


def _between(language: Language, entry: LengthEntry) -> str:
    if not isinstance(entry, CornersEntry):
        return words(language, "sides")
    a, b = (f"[{column}, {row}]" for column, row in entry.between)
    return words(language, "corners", a=a, b=b)


def _warmth(language: Language, certificate: Certificate) -> str:
    file, told_c = certificate.gauge.file, certificate.told.temperature_c
    known = {
        "reference": plain(language, file.reference_temperature_c),
        "expansion": plain(language, file.expansion_um_per_m_k),
    }
    if told_c is None:
        return words(language, "warmth_untold", **known)
    return words(language, "warmth_told", t=plain(language, told_c), **known)


def budget(language: Language, certificate: Certificate) -> str:
    """What makes the test unsure, for the length where it is most."""
    most = max(certificate.lengths, key=lambda one: one.budget.expanded_mm)
    conditions = certificate.conditions
    known = next(one for one in certificate.gauge.known if one.name == most.seen.name)
    value = millimetres(language, most.true_mm)
    text = words(language, "budget_text", name=most.seen.name, value=value, picture=most.picture)
    parts = most.budget
    warmer = millimetres(language, conditions.warmer_uncertainty_k, 2)
    high = plain(language, conditions.height_uncertainty_mm)
    per = millimetres(language, most.seen.per_height, signed=True)
    rows = [
        ("gauge", words(language, "taken_gauge", u=plain(language, known.uncertainty_mm)), parts.gauge_mm),
        ("warmth", words(language, "taken_warmth", u=warmer), parts.temperature_mm),
        ("height", words(language, "taken_height", u=high, per=per), parts.height_mm),
    ]
    told = [[words(language, f"cause_{cause}"), how, millimetres(language, u, 4)] for cause, how, u in rows]
    told.append([words(language, "all_together"), "", millimetres(language, parts.expanded_mm, 4)])
    head = [words(language, key) for key in ("cause", "taken", "standard")]
    return f"<p>{html.escape(text)}</p>{table(head, told, (2,))}"


def lengths(language: Language, certificate: Certificate) -> str:
    """Every length in every picture."""
    keys = ("picture", "name", "direction", "true", "measured", "error", "u_mm", "limit_mm", "says")
    rows = [
        [
            one.picture,
            one.seen.name,
            f"{one.seen.direction_deg:.0f}°",
            millimetres(language, one.true_mm),
            millimetres(language, one.seen.measured_mm),
            millimetres(language, one.error_mm, signed=True),
            millimetres(language, one.budget.expanded_mm),
            millimetres(language, one.limit_mm),
            words(language, f"dot_{one.decision}"),
        ]
        for one in certificate.lengths
    ]
    kinds = [one.decision.value for one in certificate.lengths]
    return table([words(language, key) for key in keys], rows, range(2, 8), kinds)


def pictures(language: Language, certificate: Certificate) -> str:
    """Each picture: whether it served, how straight the gauge came out, and its hash."""
    forms = {form.picture: form for form in certificate.forms}
    planes = {plane.picture: millimetres(language, plane.off_mm, 2, signed=True) for plane in certificate.planes}
    rows = []
    for sight in certificate.kept:
        form = forms[sight.name]
        says = words(language, "serves")
        straight, off = millimetres(language, form.form_mm), planes.get(sight.name, "–")
        rows.append([sight.name, says, form.line, straight, off, sight.digest[:HASH_SHOWN]])
    for sight in certificate.left:
        rows.append([sight.name, detail(language, sight.refused), "", "", "", sight.digest[:HASH_SHOWN]])
    keys = ("picture", "says", "least_straight", "form_mm", "plane_off", "pixels_hash")
    return table([words(language, key) for key in keys], rows, (3, 4))


def repeat(language: Language, certificate: Certificate) -> str:
    """What to do again, and the rule that it is judged by."""
    text = words(language, "repeat_text", places=certificate.told.places)
    command = f"<p><code>{html.escape(certificate.told.command)}</code></p>"
    return f"<p>{html.escape(text)}</p>{command}<p>{html.escape(words(language, 'rule'))}</p>"
