"""The scenes of the shipped sample frames: one camera, four blocks 20 mm thick, honeycomb of 9 to 12 mm pitch."""

from __future__ import annotations

from contour.synthetic import (
    CameraModel,
    CellGeometry,
    Clutter,
    Light,
    Scene,
    Table,
    camera_above,
    disc_ring,
    l_shape,
    rectangle,
    u_shape,
    with_holes,
)

CAMERA = camera_above(
    1600,
    1200,
    0.375,
    distance_mm=1200.0,
    plane_mm=20.0,
    target_mm=(300.0, 225.0),
    tilt_deg=(1.2, -0.8),
    roll_deg=0.4,
    distortion=(-0.09, 0.02, 4e-4, -3e-4, 0.0),
)
"""The camera of every sample; `samples/calibration.yaml` says the same."""

THICKNESS_MM = 20.0
JPEG_QUALITY = 92


def sample_scenes() -> tuple[Scene, ...]:
    """The sample scenes in the order of their names; `scene.name` is the file's stem."""
    return (
        Scene(
            rectangle((300.0, 225.0), 330.0, 240.0, 7.0),
            CAMERA,
            CellGeometry(pitch_mm=9.0, wall_mm=0.7, warp=0.05, ribbon_deg=7.0, broken=0.002),
            name="1-rectangle",
            seed=101,
            light=Light(gradient=0.2, vignetting=0.15),
            clutter=Clutter(specks=25, debris=6),
        ),
        Scene(
            l_shape((305.0, 222.0), 360.0, 290.0, 130.0, -11.0),
            CAMERA,
            CellGeometry(pitch_mm=10.0, wall_mm=0.75, warp=0.12, ribbon_deg=34.0, broken=0.01),
            name="2-l-shape",
            seed=102,
            light=Light(gradient=0.35, vignetting=0.25, patches=0.2),
            clutter=Clutter(specks=50, debris=16),
            table=Table(scratches=10),
        ),
        Scene(
            u_shape((295.0, 228.0), 380.0, 290.0, 115.0, 110.0, 4.0),
            CAMERA,
            CellGeometry(pitch_mm=11.0, wall_mm=0.8, warp=0.15, ribbon_deg=-20.0, broken=0.015, expansion_deg=66.0),
            name="3-u-shape",
            seed=103,
            light=Light(level=0.85, gradient=0.4, gradient_deg=200.0, vignetting=0.3, patches=0.3),
            clutter=Clutter(specks=60, debris=20),
            table=Table(level=0.14, perforation_pitch_mm=25.0),
        ),
        Scene(
            with_holes(
                rectangle((300.0, 225.0), 400.0, 280.0, -5.0),
                disc_ring((230.0, 250.0), 38.0),
                rectangle((385.0, 200.0), 70.0, 90.0, 15.0).exterior,
            ),
            CAMERA,
            CellGeometry(pitch_mm=9.0, wall_mm=0.7, warp=0.1, ribbon_deg=85.0, broken=0.01),
            name="4-with-holes",
            seed=104,
            light=Light(level=0.95, gradient=0.25, gradient_deg=100.0, vignetting=0.2, patches=0.2),
            clutter=Clutter(specks=40, debris=12),
        ),
    )


def calibration_of(camera: CameraModel, name: str = "samples") -> dict[str, object]:
    """The camera as a calibration file's content (camera model form)."""
    return {
        "version": 1,
        "kind": "camera",
        "image_width": camera.width,
        "image_height": camera.height,
        "camera_name": name,
        "distortion_model": "plumb_bob",
        "camera_matrix": {"rows": 3, "cols": 3, "data": camera.matrix.ravel().tolist()},
        "distortion_coefficients": {"rows": 1, "cols": 5, "data": list(camera.distortion)},
        "work_plane": {
            "rotation_vector": list(camera.rotation_vector),
            "translation_mm": list(camera.translation_mm),
        },
        "alignment": {"rotation_deg": 0.0, "translation_mm": [0.0, 0.0]},
    }
