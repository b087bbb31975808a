"""The bounds of a job, and the controller that it belongs to, as the configuration says."""

from __future__ import annotations

from service.config.config import Config
from service.config.controllers import NoController
from service.jobs.cycle_terms import CycleSettings, MailboxFormat
from service.link.transfer_terms import TransferSettings

TARGET_KEYS = {
    *("kind", "host", "port", "device_id", "word_order", "handshake", "mode"),
    *("link_address", "service_address", "contour_address", "payload_capacity", "part_block"),
}


def cycle_settings(config: Config) -> CycleSettings:
    """The bounds of a job."""
    settings = config.controller
    if isinstance(settings, NoController):
        return CycleSettings(camera_timeout_s=config.camera.timeout_s, target=target(config))
    return CycleSettings(
        camera_timeout_s=config.camera.timeout_s,
        valid_for_s=settings.valid_for_s,
        job_timeout_s=settings.job_timeout_s,
        observe=settings.mode == "observe",
        mailbox=MailboxFormat(
            settings.word_order,
            settings.payload_capacity,
            None if settings.part_block is None else settings.part_block.capacity,
        ),
        transfer=TransferSettings(
            handshake=settings.handshake == "full",
            readback=settings.readback,
            ready_timeout_s=settings.ready_timeout_s,
            ack_timeout_s=settings.ack_timeout_s,
            max_repeats=settings.max_repeats,
            poll_period_s=settings.poll_period_s,
        ),
        target=target(config),
    )


def target(config: Config) -> dict[str, str | int]:
    """Which controller it is and how it is laid out: the keys that must not change while a job is in flight there."""
    # Without what is not configured: a job that an older version sent knows no such key.
    return config.controller.model_dump(mode="json", include=TARGET_KEYS, exclude_none=True)
