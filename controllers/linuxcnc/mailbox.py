"""The controller's part of the contour mailbox protocol, version 1, on plain registers: standard library only.

One thread calls `scan`; reads and writes of the Modbus server come from others, each whole under one lock.
"""

import binascii
import json
import os
import random
import struct
import threading
import time

import part_block

LINK, SERVICE, CONTOUR = 0, 16, 32
HEADER = 32
ACCEPTED, BAD_CRC, BAD_LAYOUT, BAD_GEOMETRY, EXPIRED, BEFORE, OPERATOR, OUTDATED, MISSING, NOT_READY, WITHDRAWN = range(
    1, 12
)
FINAL = (ACCEPTED, BAD_GEOMETRY, EXPIRED, OPERATOR, WITHDRAWN)
NOT_READY_STATE, READY_STATE, BUSY_STATE, FAULT_STATE = range(4)
WRAP = 1 << 32


class Contour:
    """An accepted contour: rings of (x, y) in mm, exterior first and counter-clockwise, holes clockwise.

    expires_at_ms: on the clock of `Mailbox.clock_ms`, None = never; whoever cuts later compares again. parts: what is
    to be cut from it, by part-block.md; without any, the contour itself.
    """

    parts = ()

    def __init__(self, job_id, recipe, rings, area_mm2, uncertainty_um, flags, expires_at_ms):
        self.job_id = job_id
        self.recipe = recipe
        self.rings = rings
        self.area_mm2 = area_mm2
        self.uncertainty_mm = None if uncertainty_um == WRAP - 1 else uncertainty_um / 1000
        self.flags = flags
        self.expires_at_ms = expires_at_ms


class Memory:
    """`last_job` and `last_result`, kept over a restart: written to another file, made durable, renamed."""

    def __init__(self, path):
        self.path = path
        self.last_job = self.last_result = self.sessions = 0
        try:
            with open(path, encoding="ascii") as file:
                kept = json.load(file)
            self.last_job, self.last_result, self.sessions = kept["last_job"], kept["last_result"], kept["sessions"]
        except FileNotFoundError:
            self.sessions = random.randrange(1, 65535)  # nothing is known of the sessions before
        except (OSError, ValueError, KeyError) as error:
            raise SystemExit(
                f"{path}: cannot be read ({error}); expected what this bridge wrote. The last job is not known: "
                "make sure that no contour is under way, then delete the file"
            ) from error

    def keep(self, last_job, last_result):
        """One step: after it both are kept, before it neither."""
        self.last_job, self.last_result = last_job, last_result
        self._write()

    def new_session(self):
        """A session number that differs from the one before, never 0."""
        self.sessions = self.sessions % 65535 + 1
        self._write()
        return self.sessions

    def _write(self):
        beside = f"{self.path}.new"
        with open(beside, "w", encoding="ascii") as file:
            json.dump({"last_job": self.last_job, "last_result": self.last_result, "sessions": self.sessions}, file)
            file.flush()
            os.fsync(file.fileno())
        os.replace(beside, self.path)
        folder = os.open(os.path.dirname(os.path.abspath(self.path)), os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


class Mailbox:
    """Registers, and what the controller does with them.

    judge: called with a whole contour, gives ACCEPTED, BAD_GEOMETRY or OPERATOR. on_accepted: called with it once it
    is in memory. word_order: "big" or "little". part_capacity: of the part block, which begins where the contour block
    ends; None = there is none.
    """

    def __init__(self, memory, judge, on_accepted, word_order="big", payload_capacity=1984, part_capacity=None):
        self.lock = threading.Lock()
        self.part_address = CONTOUR + HEADER + payload_capacity
        self.has_parts = part_capacity is not None
        self.registers = [0] * (self.part_address + (part_block.HEADER + part_capacity if self.has_parts else 0))
        self.capacity = payload_capacity
        self.writable = range(SERVICE, len(self.registers))
        self._memory, self._judge, self._on_accepted = memory, judge, on_accepted
        self._big = word_order == "big"
        self._held = []
        self._part_block = []
        self._heartbeat = 0
        self._open = False  # a trigger of ours is neither answered by a contour nor told that there will be none
        self._taken = None  # the job that the service made of it
        self._started = time.monotonic()
        self.session = memory.new_session()
        with self.lock:
            self._put32(LINK + 10, memory.last_job)
            self.registers[LINK + 12] = memory.last_result
            self.registers[LINK + 13] = self.session

    # --- for the bridge ------------------------------------------------------------------------------------------

    def clock_ms(self):
        """Milliseconds since the start, as the service sees them; not 0, which would mean that there is no clock."""
        return (int((time.monotonic() - self._started) * 1000) + 1) % WRAP or 1

    def set_state(self, state):
        """controller_state."""
        with self.lock:
            self.registers[LINK] = state

    @property
    def state(self):
        """controller_state."""
        return self.registers[LINK]

    def service_is_ready(self):
        """Whether a trigger would be taken: the service is Ready, and no trigger is open."""
        with self.lock:
            return self.registers[SERVICE + 1] == 5 and not self._open

    def request(self, recipe=0, thickness_um=0):
        """Ask for one measurement; False where the service is not ready for it or a trigger is still open."""
        with self.lock:
            if self.registers[SERVICE + 1] != 5 or self._open:
                return False
            self.registers[LINK + 3] = recipe
            self._put32(LINK + 4, thickness_um)
            self.registers[LINK + 2] = self.registers[LINK + 2] % 65535 + 1
            self._open, self._taken = True, None
            return True

    def open_trigger(self):
        """Whether a trigger of ours is not yet settled."""
        with self.lock:
            return self._open

    # --- for the Modbus server -----------------------------------------------------------------------------------

    def write(self, start, words):
        """Registers as the service wrote them; what it says of our trigger is taken note of at each write."""
        with self.lock:
            self.registers[start : start + len(words)] = list(words)
            self._follow_trigger()

    def _follow_trigger(self):
        """A trigger is closed when `settled_job` reaches the job that came with its acknowledgement: later jobs are
        other triggers' business.
        """
        acknowledged = (self.registers[SERVICE + 3], self.registers[SERVICE + 10])
        if self._open and self._taken is None and acknowledged == (self.registers[LINK + 2], self.session):
            self._taken = self._get32(SERVICE + 6)
        if self._open and self._taken is not None and self._get32(SERVICE + 12) >= self._taken:
            self._open = False

    # --- one scan ------------------------------------------------------------------------------------------------

    def scan(self):
        """Once a scan cycle: heartbeat, clock, echo, and an answer where a page waits; memory before the answer."""
        with self.lock:
            self._heartbeat += 1
            if self._heartbeat % 10 == 0:
                self.registers[LINK + 1] = (self.registers[LINK + 1] + 1) % 65536
            self._put32(LINK + 14, self.clock_ms())
            self._put32(LINK + 8, (self._get32(SERVICE + 8) + 1) % WRAP)
            page = self.registers[CONTOUR : self.part_address]
            self._part_block = self.registers[self.part_address :]
            state, counter = self.registers[LINK], self.registers[LINK + 2]
            is_open = self._open
            if page[0] in (0, self.registers[LINK + 6]):
                return  # nothing to answer
        answer, job_id, contour = self._answer(page, state, counter, is_open)
        is_final = answer in FINAL and (answer != ACCEPTED or contour is not None) and job_id > self._memory.last_job
        if is_final:
            self._memory.keep(job_id, answer)
            self._held = []
        with self.lock:
            if is_final:
                self.registers[LINK + 12] = answer
                self._put32(LINK + 10, job_id)
                self._open = self._open and page[31] != self.registers[LINK + 2]
            self.registers[LINK + 7] = answer
            self.registers[LINK + 6] = page[0]
        if contour is not None:
            self._on_accepted(contour)

    def _answer(self, page, state, counter, is_open):
        """The answer to a page, its job, and the contour where it is whole and accepted."""
        length = page[7]
        job_id = self._of32(page, 2)
        if length > self.capacity:
            return BAD_LAYOUT, job_id, None
        if crc32(page, length) != self._of32(page, 8):
            return BAD_CRC, job_id, None
        if page[1] not in (0, 1):
            return BAD_LAYOUT, job_id, None
        if page[30] != self.session or job_id < self._memory.last_job:
            return OUTDATED, job_id, None
        if job_id == self._memory.last_job:
            same = self._memory.last_result
            return (BEFORE if same == ACCEPTED else same), job_id, None
        if page[1] == 0:
            return WITHDRAWN, job_id, None
        valid_for, age = self._of32(page, 28), (self.clock_ms() - self._of32(page, 24)) % WRAP
        foreign = page[31] != counter if page[31] else is_open
        if (valid_for and age > valid_for) or foreign:
            return EXPIRED, job_id, None
        if state != READY_STATE:
            return NOT_READY, job_id, None
        return self._turned(page, job_id, valid_for)

    def _turned(self, page, job_id, valid_for):
        """Pages in order; on the last one the contour is put together and judged."""
        number, count = page[4], page[5]
        if number == 1:
            self._held = []
        if not (1 <= number <= count):
            return MISSING, job_id, None
        common = [word for index, word in enumerate(page[:HEADER]) if index not in (0, 4, 7, 8, 9, 27)]
        if self._held and self._held[0][0] != common:
            return MISSING, job_id, None
        if number <= len(self._held):
            return ACCEPTED, job_id, None
        if number != len(self._held) + 1:
            return MISSING, job_id, None
        if self.has_parts and number == count and not part_block.belongs_to(self._part_block, page, self._of32):
            return BAD_CRC, job_id, None
        self._held.append((common, page[HEADER : HEADER + page[7]]))
        if number < count:
            return ACCEPTED, job_id, None
        rings = self._rings(page)
        placed = part_block.parts(self._part_block, self._of32, self._signed) if self.has_parts else ()
        if rings is None or placed is None:
            self._held = []
            return BAD_LAYOUT, job_id, None
        expires = (self._of32(page, 24) + valid_for) % WRAP if valid_for else None
        contour = Contour(job_id, page[26], rings, self._of32(page, 20), self._of32(page, 22), page[27], expires)
        contour.parts = placed
        verdict = self._judge(contour)
        return verdict, job_id, contour if verdict == ACCEPTED else None

    def _rings(self, page):
        """Rings in mm of all pages held, None where counts, table or bounding box contradict the points."""
        words = [word for _, payload in self._held for word in payload]
        ring_count, points = page[6], self._of32(page, 10)
        if ring_count < 1 or len(words) != 2 * ring_count + 4 * points or len(words) % 2:
            return None
        counts = [self._of32(words, 2 * index) for index in range(ring_count)]
        if sum(counts) != points or min(counts) < 3:
            return None
        values = [self._signed(words, 2 * index) for index in range(ring_count, len(words) // 2)]
        pairs = list(zip(values[::2], values[1::2], strict=True))
        xs, ys = [x for x, _ in pairs], [y for _, y in pairs]
        box = [self._signed(page, 12 + 2 * index) for index in range(4)]
        if box != [min(xs), min(ys), max(xs), max(ys)]:
            return None
        rings, start = [], 0
        for count in counts:
            rings.append([(x / 1000, y / 1000) for x, y in pairs[start : start + count]])
            start += count
        return rings

    # --- numbers -------------------------------------------------------------------------------------------------

    def _of32(self, words, index):
        high, low = (words[index], words[index + 1]) if self._big else (words[index + 1], words[index])
        return high << 16 | low

    def _signed(self, words, index):
        value = self._of32(words, index)
        return value - WRAP if value >= WRAP // 2 else value

    def _get32(self, address):
        return self._of32(self.registers, address)

    def _put32(self, address, value):
        high, low = value >> 16 & 0xFFFF, value & 0xFFFF
        self.registers[address : address + 2] = [high, low] if self._big else [low, high]


def crc32(page, length):
    """CRC-32 of a page by the protocol: header from offset 1, its own two registers as 0, then the payload."""
    words = [*page[1:8], 0, 0, *page[10 : HEADER + length]]
    return binascii.crc32(struct.pack(f">{len(words)}H", *words))
