"""Why a job was not accepted: name, code, outcome, what it means, and what a person does next, in each language.

The one table behind registers, journal, serial replies, log, commands and docs/reference/reasons.md
(`python -m service.reasons_doc docs/reference/reasons.md`); codes and names are the protocol's.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum, StrEnum


class Outcome(StrEnum):
    """How a job ends: the block or picture was not good enough (refused), or something did not work (failed)."""

    ACCEPTED = "accepted"
    WRITTEN = "written"
    REFUSED = "refused"
    FAILED = "failed"


class Language(StrEnum):
    """Languages that reasons are told in."""

    ENGLISH = "en"
    RUSSIAN = "ru"


class Reason(IntEnum):
    """Reject reasons by code; `reject_reason` in the service block. The first (lowest) that applies is told."""

    NO_FRAME = 100
    STALE_FRAME = 101
    IMAGE_QUALITY = 102
    SCENE_MOVED = 103
    NO_BLOCK_FOUND = 110
    TOUCHES_BORDER = 111
    AREA_OUT_OF_LIMITS = 112
    METHODS_DISAGREE = 113
    UNCERTAINTY_TOO_LARGE = 114
    OUTSIDE_WORK_AREA = 115
    SEVERAL_BLOCKS = 116
    EDGE_COVERED = 117
    EDGE_CONTRADICTED = 118
    PART_DOES_NOT_FIT = 119
    BUSY = 120
    NOT_READY = 121
    UNKNOWN_RECIPE = 122
    TOO_MANY_POINTS = 130
    SELF_INTERSECTING = 131
    CALIBRATION_MISSING = 140
    CALIBRATION_MISMATCH = 141
    SENTINEL_MOVED = 142
    CONTROLLER_TIMEOUT = 150
    CONTROLLER_REFUSED = 151
    CONTROLLER_LOST = 152
    CONTROLLER_RESTARTED = 153
    SERVICE_RESTARTED = 154
    OTHER_SERVICE = 155
    EXPIRED = 156
    STORAGE_FULL = 160
    ABORTED = 161
    INTERNAL_ERROR = 190

    @property
    def label(self) -> str:
        """The protocol's name of the reason: `no_block_found`."""
        return self.name.lower()

    @property
    def outcome(self) -> Outcome:
        """Refused for 101 to 142 and 151, failed for 100 and all others (protocol, "Reject reasons")."""
        refused = Reason.STALE_FRAME <= self <= Reason.SENTINEL_MOVED or self is Reason.CONTROLLER_REFUSED
        return Outcome.REFUSED if refused else Outcome.FAILED

    def explained(self, language: Language = Language.ENGLISH) -> Explanation:
        """What the reason means and what to do next."""
        return _TABLE[self][0 if language is Language.ENGLISH else 1]


Rejection = tuple[Reason, str]
"""A reason to refuse a picture, and the sentence with the measured value and the limit."""


@dataclass(frozen=True)
class Explanation:
    """What a reason means, in one sentence, and the next action for the person at the machine."""

    sentence: str
    next_action: str

    def __str__(self) -> str:
        return f"{self.sentence} {self.next_action}"


# English and Russian of each reason.
_TABLE: dict[Reason, tuple[Explanation, Explanation]] = {
    Reason.NO_FRAME: (
        Explanation("The camera gave no usable picture.", "Check the camera's power and cable, or the file it reads."),
        Explanation("Камера не дала пригодного снимка.", "Проверьте питание и кабель камеры или файл снимка."),
    ),
    Reason.STALE_FRAME: (
        Explanation(
            "The picture was exposed before the trigger.", "Trigger again; if it comes back, check the camera's driver."
        ),
        Explanation(
            "Снимок сделан раньше команды на измерение.",
            "Запустите измерение снова; если повторится, проверьте драйвер камеры.",
        ),
    ),
    Reason.IMAGE_QUALITY: (
        Explanation(
            "The picture is too blurred, too dark, too bright or too flat, the table is as light as the block's walls, "
            "or the light is not as it was taught.",
            "Clean the lens, check focus, exposure, lamp and table; after a lasting change of light teach the table "
            "again.",
        ),
        Explanation(
            "Снимок нерезкий, слишком тёмный, засвеченный или малоконтрастный, стол такой же светлый, как стенки сот, "
            "либо свет не тот, при котором снимали пустой стол.",
            "Протрите объектив, проверьте фокус, выдержку, лампу и стол; если свет изменили насовсем, снимите пустой "
            "стол заново (teach-table).",
        ),
    ),
    Reason.SCENE_MOVED: (
        Explanation(
            "The scene moved: during the measurement, or the camera or the table since it was taught.",
            "Keep hands away and trigger again; if camera or table were moved, calibrate and teach the table again.",
        ),
        Explanation(
            "Снимок сместился: что-то двигалось во время измерения, либо камеру или стол сдвинули после того, как "
            "снимали пустой стол.",
            "Уберите руки и запустите измерение снова; если сдвинули камеру или стол, откалибруйте камеру и снимите "
            "пустой стол заново (teach-table).",
        ),
    ),
    Reason.NO_BLOCK_FOUND: (
        Explanation(
            "No block was found in the picture.", "Check that a block lies on the table, the light, and the recipe."
        ),
        Explanation(
            "На снимке не найдена заготовка.", "Проверьте, лежит ли заготовка на столе, а также свет и рецепт."
        ),
    ),
    Reason.TOUCHES_BORDER: (
        Explanation(
            "The block's contour reaches the edge of the picture or of the region of interest.",
            "Move the block to the middle of the camera's view.",
        ),
        Explanation(
            "Контур заготовки доходит до края снимка или заданной области кадра.",
            "Сдвиньте заготовку к середине поля зрения камеры.",
        ),
    ),
    Reason.AREA_OUT_OF_LIMITS: (
        Explanation(
            "The contour's area is outside the recipe's limits.",
            "Check that the right block lies there, or the recipe.",
        ),
        Explanation(
            "Площадь контура вне пределов рецепта.", "Проверьте, та ли заготовка лежит на столе и тот ли выбран рецепт."
        ),
    ),
    Reason.METHODS_DISAGREE: (
        Explanation(
            "An independent estimate of the contour differs too much.",
            "Remove what lies against the block, check light and table, and look at the overlay.",
        ),
        Explanation(
            "Контур слишком расходится с независимой оценкой.",
            "Уберите посторонние предметы у заготовки, проверьте свет и стол, посмотрите контур на снимке.",
        ),
    ),
    Reason.UNCERTAINTY_TOO_LARGE: (
        Explanation(
            "The contour is less certain than a quarter of a cell, or than the recipe allows.",
            "Check light, focus and the block's edge.",
        ),
        Explanation(
            "Погрешность контура больше четверти ячейки или больше, чем допускает рецепт.",
            "Проверьте свет, фокус и кромку заготовки.",
        ),
    ),
    Reason.OUTSIDE_WORK_AREA: (
        Explanation(
            "The contour leaves the machine's work area, or the part of the picture that the calibration covers.",
            "Move the block into the work area, towards the middle of the camera's view.",
        ),
        Explanation(
            "Контур выходит за рабочую зону станка или за часть снимка, охваченную калибровкой.",
            "Переложите заготовку в рабочую зону, ближе к середине поля зрения камеры.",
        ),
    ),
    Reason.SEVERAL_BLOCKS: (
        Explanation(
            "More than one block lies on the table.",
            "Leave one block on the table, or use a recipe with pieces: largest.",
        ),
        Explanation(
            "На столе больше одной заготовки.",
            "Оставьте на столе одну заготовку или выберите рецепт, который берёт наибольшую (pieces: largest).",
        ),
    ),
    Reason.EDGE_COVERED: (
        Explanation(
            "Something lies over the block's edge, or hides it.",
            "Take away what lies there: tape, clamps, hands, cables; the overlay shows in red where.",
        ),
        Explanation(
            "Кромка заготовки чем-то закрыта.",
            "Уберите то, что лежит на кромке: ленту, прижим, руку, кабель; на снимке это место отмечено красным.",
        ),
    ),
    Reason.EDGE_CONTRADICTED: (
        Explanation(
            "The block's border is not of the kind that the recipe's edge promises.",
            "Put edge: auto into the recipe, or the kind that the text names; check that the right block lies there.",
        ),
        Explanation(
            "Кромка заготовки не такова, как обещает edge в рецепте.",
            "Укажите в рецепте edge: auto или тот вид, что назван в тексте; проверьте, та ли заготовка лежит.",
        ),
    ),
    Reason.PART_DOES_NOT_FIT: (
        Explanation(
            "The recipe's part does not fit into the block with its margin.",
            "Lay a larger block there, or check the part, its margin and the turns allowed; the overlay shows the "
            "tightest place.",
        ),
        Explanation(
            "Деталь из рецепта не помещается в заготовку с нужным припуском.",
            "Положите заготовку побольше либо проверьте чертёж детали, припуск и разрешённые повороты; самое узкое "
            "место отмечено на снимке.",
        ),
    ),
    Reason.BUSY: (
        Explanation("A job is being executed.", "Wait for it to end and trigger again."),
        Explanation("Выполняется другое задание.", "Дождитесь его завершения и запустите измерение снова."),
    ),
    Reason.NOT_READY: (
        Explanation("The service or the controller is not ready.", "See the service's state and its reason."),
        Explanation("Служба или станок не готовы.", "Посмотрите состояние службы и причину."),
    ),
    Reason.UNKNOWN_RECIPE: (
        Explanation(
            "The trigger names a recipe that the configuration does not have.", "Add the recipe, or correct its number."
        ),
        Explanation("Запрошенного рецепта нет в настройках.", "Добавьте рецепт или исправьте его номер."),
    ),
    Reason.TOO_MANY_POINTS: (
        Explanation(
            "The contour has more vertices than the recipe or the mailbox holds.",
            "Raise tolerance_mm, max_vertices or payload_capacity.",
        ),
        Explanation(
            "В контуре больше вершин, чем допускает рецепт или вмещают регистры.",
            "Увеличьте tolerance_mm, max_vertices или payload_capacity.",
        ),
    ),
    Reason.SELF_INTERSECTING: (
        Explanation("The contour crosses itself or its holes.", "Look at the overlay; check light and method."),
        Explanation(
            "Контур пересекает сам себя или свои отверстия.", "Посмотрите контур на снимке; проверьте свет и метод."
        ),
    ),
    Reason.CALIBRATION_MISSING: (
        Explanation(
            "There is no calibration file, so pixels cannot become millimetres.", "Calibrate, and name the file."
        ),
        Explanation(
            "Нет файла калибровки: пиксели не перевести в миллиметры.",
            "Откалибруйте камеру и укажите файл в настройках.",
        ),
    ),
    Reason.CALIBRATION_MISMATCH: (
        Explanation(
            "The calibration does not fit the camera or the picture.",
            "Use the file made for this camera and resolution.",
        ),
        Explanation(
            "Калибровка не подходит к камере или снимку.", "Возьмите файл, сделанный для этой камеры и её разрешения."
        ),
    ),
    Reason.SENTINEL_MOVED: (
        Explanation(
            "A fixed mark is not where the calibration saw it.",
            "Check that the camera was not moved; calibrate again.",
        ),
        Explanation(
            "Контрольная метка не там, где была при калибровке.",
            "Проверьте, не сдвинута ли камера; откалибруйте заново.",
        ),
    ),
    Reason.CONTROLLER_TIMEOUT: (
        Explanation("The controller did not answer in time; the job was withdrawn.", "Check the controller's program."),
        Explanation("Контроллер станка не ответил вовремя; задание отозвано.", "Проверьте программу контроллера."),
    ),
    Reason.CONTROLLER_REFUSED: (
        Explanation("The controller refused the contour.", "See its answer at the controller or in the journal."),
        Explanation("Контроллер станка отклонил контур.", "Посмотрите его ответ на станке или в журнале."),
    ),
    Reason.CONTROLLER_LOST: (
        Explanation("The connection to the controller was lost.", "Check the controller's power, cable and address."),
        Explanation("Потеряна связь с контроллером станка.", "Проверьте питание, кабель и адрес контроллера."),
    ),
    Reason.CONTROLLER_RESTARTED: (
        Explanation(
            "The controller's program restarted during the job.", "Trigger again; check whether it had accepted before."
        ),
        Explanation(
            "Программа контроллера перезапустилась во время задания.",
            "Запустите измерение снова; проверьте, не принял ли станок контур раньше.",
        ),
    ),
    Reason.SERVICE_RESTARTED: (
        Explanation("The service restarted during the job.", "Trigger again."),
        Explanation("Служба перезапустилась во время задания.", "Запустите измерение снова."),
    ),
    Reason.OTHER_SERVICE: (
        Explanation(
            "Another service writes to this controller.", "Stop one of the two; one controller has one service."
        ),
        Explanation(
            "В этот контроллер пишет другая служба.", "Остановите одну из двух: у контроллера может быть одна служба."
        ),
    ),
    Reason.EXPIRED: (
        Explanation(
            "The contour became too old before the controller took it.", "Check why the controller was not ready."
        ),
        Explanation("Контур устарел раньше, чем станок его принял.", "Проверьте, почему станок был не готов."),
    ),
    Reason.STORAGE_FULL: (
        Explanation("The disk is full.", "Free space on the state and archive disk."),
        Explanation("Диск заполнен.", "Освободите место на диске журнала и архива."),
    ),
    Reason.ABORTED: (
        Explanation("The job was ended by a halt or shutdown.", "Trigger again when the service is Ready."),
        Explanation("Задание прервано остановкой службы.", "Запустите измерение снова, когда служба будет готова."),
    ),
    Reason.INTERNAL_ERROR: (
        Explanation("The service met an error of its own.", "Keep the log and the picture, and report them."),
        Explanation("Внутренняя ошибка службы.", "Сохраните журнал и снимок и сообщите разработчику."),
    ),
}
