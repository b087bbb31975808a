#!/usr/bin/env python3
"""Writes golden_vectors.st, a program that tries combtrace.st in a PLC on the project's golden vectors.

python3 controllers/iec61131/golden_vectors.py docs/reference/golden-vectors.json controllers/iec61131/golden_vectors.st
"""

import json
import sys
from pathlib import Path

ACCEPTED, BAD_CRC, BEFORE = 1, 2, 6
HOLES = "two holes"
A_LINE = 8

PROGRAM = """\
(* Written by golden_vectors.py from docs/reference/golden-vectors.json; do not edit.

   Tries combtrace.st in a PLC, without Modbus: run CT_TRY in any task after a cold start (nothing retained) until done
   is TRUE. All is well where failed = 0 and passed = {checks}. Each page's CRC and box are computed first, one page a
   scan; then an instance of CT_MAILBOX gets pages as the service would write them. first_failed: which check, from 0
   on. *)
PROGRAM CT_TRY
VAR
    words : ARRAY[0..{last_word}] OF WORD := [
{words}];
    from_word : ARRAY[0..{last_page}] OF INT := [
{from_word}];
    count : ARRAY[0..{last_page}] OF INT := [
{count}];
    swapped : ARRAY[0..{last_page}] OF INT := [
{swapped}];
    least_x : ARRAY[0..{last_page}] OF DWORD := [
{least_x}];
    sent : ARRAY[0..{last_step}] OF INT := [{sent}];
    expected : ARRAY[0..{last_step}] OF UINT := [{expected}];
    box : CT_MAILBOX;
    reg : ARRAY[0..2047] OF WORD;
    done : BOOL;
    passed : INT;
    failed : INT;
    first_failed : INT := -1;
    check : INT;
    step_nr : INT;
    scans : INT;
    written : BOOL;
    good : BOOL;
    over : BOOL;
    start : INT;
    crc : DWORD;
    k : INT;
END_VAR

over := FALSE;
IF NOT done AND check <= {last_page} THEN
    start := from_word[check];
    crc := DWORD#16#FFFFFFFF;
    FOR k := 0 TO count[check] - 1 DO
        IF k = 7 OR k = 8 THEN
            crc := CT_CRC(crc := crc, register := WORD#16#0000);
        ELSE
            crc := CT_CRC(crc := crc, register := words[start + k]);
        END_IF;
    END_FOR;
    good := (crc XOR DWORD#16#FFFFFFFF) =
        CT_JOIN(first := words[start + 7], second := words[start + 8], little := swapped[check] = 1);
    IF CT_JOIN(first := words[start + 11], second := words[start + 12], little := swapped[check] = 1)
        <> least_x[check] THEN
        good := FALSE;
    END_IF;
    over := TRUE;
ELSIF NOT done THEN
    box(reg := reg, state := UINT#1, now_ms := UDINT#{now_ms}, seed := UINT#{session}, take_simulated := TRUE);
    step_nr := check - {pages};
    IF reg[13] = WORD#16#0000 THEN
        scans := 0;
    ELSIF NOT written THEN
        start := from_word[sent[step_nr]];
        FOR k := 0 TO count[sent[step_nr]] - 1 DO
            reg[33 + k] := words[start + k];
        END_FOR;
        IF step_nr = 0 THEN
            reg[64] := reg[64] XOR WORD#16#0010;     (* one wrong bit *)
        END_IF;
        reg[32] := UINT_TO_WORD(INT_TO_UINT(step_nr + 1));
        written := TRUE;
        scans := 0;
    ELSE
        scans := scans + 1;
        IF reg[6] = reg[32] OR scans > 100 THEN
            good := (reg[6] = reg[32]) AND (WORD_TO_UINT(reg[7]) = expected[step_nr]);
            over := TRUE;
        END_IF;
    END_IF;
END_IF;

IF over THEN
    IF check = {last_check} THEN
        good := good AND (box.ring_count = UINT#3) AND (box.point_count = UDINT#{points}) AND (box.area = UDINT#{area});
    END_IF;
    IF good THEN
        passed := passed + 1;
    ELSE
        failed := failed + 1;
        IF first_failed < 0 THEN
            first_failed := check;
        END_IF;
    END_IF;
    check := check + 1;
    written := FALSE;
    done := check > {last_check};
END_IF;
END_PROGRAM
"""


def program(vectors):
    """The program's text."""
    pages, words = [], []
    holes = None
    for contour in vectors["contours"]:
        for page in contour["pages"]:
            if contour["name"].startswith(HOLES) and contour["word_order"] == "big":
                holes = len(pages), contour
            least = min(x for ring in (contour["exterior"], *contour["holes"]) for x, _ in ring)
            pages.append(
                (
                    len(words),
                    31 + len(page["payload"]),
                    int(contour["word_order"] == "little"),
                    f"16#{least % 2**32:08X}",
                )
            )
            words += [*page["header"], *page["payload"]]
    withdrawal = next(
        page for page in vectors["withdrawals"] if page["word_order"] == "big" and page["job_id"] == holes[1]["job_id"]
    )
    pages.append((len(words), 31, 0, "16#00000000"))
    words += withdrawal["header"]
    steps = [(holes[0], BAD_CRC), (holes[0], ACCEPTED), (holes[0], BEFORE), (len(pages) - 1, BEFORE)]
    columns = [_lines(map(str, column)) for column in zip(*pages, strict=True)]
    return PROGRAM.format(
        checks=len(pages) + len(steps),
        words=_lines(f"16#{word:04X}" for word in words),
        from_word=columns[0],
        count=columns[1],
        swapped=columns[2],
        least_x=columns[3],
        sent=", ".join(str(page) for page, _ in steps),
        expected=", ".join(str(answer) for _, answer in steps),
        last_word=len(words) - 1,
        last_page=len(pages) - 1,
        pages=len(pages),
        last_step=len(steps) - 1,
        last_check=len(pages) + len(steps) - 1,
        now_ms=holes[1]["captured_at"] + 10,
        session=holes[1]["session"],
        points=sum(len(ring) for ring in (holes[1]["exterior"], *holes[1]["holes"])),
        area=holes[1]["area"],
    )


def _lines(values):
    values = list(values)
    return ",\n".join("        " + ", ".join(values[i : i + A_LINE]) for i in range(0, len(values), A_LINE))


if __name__ == "__main__":
    vectors = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    Path(sys.argv[2]).write_text(program(vectors), encoding="utf-8")
