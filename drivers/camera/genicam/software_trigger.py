"""The software triggers of one job: the first at once, another where its frame was broken or never came."""

from __future__ import annotations

from drivers.camera.genicam.features import Features

# A frame whose every packet was lost never comes: after the exposure and this, the camera is triggered once more.
PATIENCE_S = 0.5


class SoftwareTrigger:
    """Gives triggers, and knows how many of them still owe a frame. exposure_s: None = not known."""

    def __init__(self, features: Features, exposure_s: float | None) -> None:
        self._features = features
        self._patience_s = PATIENCE_S + 2 * (exposure_s or 0.0)
        self._due = True
        self._latest_at_s = 0.0
        self.first_at_s: float | None = None
        self.owed = 0
        self.unanswered = 0  # since the camera was opened

    def begin(self) -> None:
        """A job begins."""
        self._due, self.first_at_s, self.owed = True, None, 0

    def give_if_due(self, now_s: float) -> None:
        """Trigger, unless a frame is on its way."""
        if not self._due and now_s - self._latest_at_s <= self._patience_s:
            return
        self.unanswered += not self._due
        self._due, self._latest_at_s = False, now_s
        self.first_at_s = now_s if self.first_at_s is None else self.first_at_s
        self.owed += 1
        self._features.run("TriggerSoftware")

    def frame_came(self, *, usable: bool) -> None:
        """One is owed less; another is due where this one was of no use."""
        self.owed = max(0, self.owed - 1)
        self._due = not usable
