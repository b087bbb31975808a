"""The wheel, built and run in another folder and environment: what runs only beside its sources is found out here."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from importlib.metadata import distributions
from pathlib import Path

ROOT = Path(__file__).parents[3]


def run(*command: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL_ENV"))}
    return subprocess.run(
        [str(part) for part in command], capture_output=True, text=True, check=False, cwd=cwd, env=environment
    )


def test_the_wheel_runs_in_another_folder_and_environment(tmp_path: Path) -> None:
    sources = tmp_path / "sources"
    shutil.copytree(
        ROOT, sources, symlinks=True, ignore=shutil.ignore_patterns(".venv", ".git", "*.egg-info", "build", ".*cache")
    )
    built = run(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", tmp_path, sources, cwd=tmp_path)
    assert built.returncode == 0, built.stdout + built.stderr
    (wheel,) = tmp_path.glob("*.whl")
    shutil.rmtree(sources)

    environment = tmp_path / "environment"
    assert run(sys.executable, "-m", "venv", "--without-pip", environment, cwd=tmp_path).returncode == 0
    python = environment / "bin" / "python"
    (packages,) = environment.glob("lib/python*/site-packages")
    (tested,) = {str(Path(path)) for path in sys.path if path.endswith("site-packages")}
    # What the wheel depends on comes from the tested environment; combtrace itself must come from the wheel, so the
    # editable install's own pointer, a .pth file, is not followed: addsitedir would, a plain path does not.
    (packages / "dependencies.pth").write_text(tested + "\n")
    # Who runs the daemon need not have what only tests on hardware use.
    (packages / "pytest.py").write_text("raise ModuleNotFoundError(name='pytest')\n")
    installed = run(
        sys.executable, "-m", "pip", "install", "--no-deps", "--no-index", "--target", packages, wheel, cwd=tmp_path
    )
    assert installed.returncode == 0, installed.stderr

    where = run(python, "-c", "import service, contour, drivers; print(service.__file__)", cwd=tmp_path)
    assert where.stdout.startswith(str(packages)), where.stdout + where.stderr
    demo = run(python, "-m", "service.cli.main", "demo", "--output", "out", cwd=tmp_path)
    assert demo.returncode == 0, demo.stdout + demo.stderr
    assert "equal to what was sent" in demo.stdout
    assert (tmp_path / "out" / "1-rectangle-contour.png").exists()
    version = run(python, "-m", "service.cli.main", "--version", cwd=tmp_path)
    assert version.stdout.startswith("combtrace ")
    suite = run(python, "-c", "import service.commissioning.hil", cwd=tmp_path)
    assert suite.stderr.endswith(
        "pytest is not installed, the fixture `hil` needs it. Install it: pip install 'combtrace[hil]'\n"
    )
    (installed_as,) = distributions(name="combtrace", path=[str(packages)])
    assert [line for line in installed_as.requires or () if "pytest" in line and "extra ==" not in line] == []
