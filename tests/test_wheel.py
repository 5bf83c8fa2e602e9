"""What an installation brings: the packages and the models, and nothing else at the top."""

import subprocess
import sys
import zipfile

import pytest
from support.paths import ROOT


@pytest.mark.slow
def test_the_wheel_holds_the_packages_and_their_models_alone(tmp_path):
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    assert {name.split("/")[0] for name in names if ".dist-info/" not in name} == {"cell", "ik", "slicing"}
    for wanted in (
        "cell/models/cases/propeller.case.yaml",
        "cell/models/parts/propeller.stl",
        "cell/html/web/report.css",
    ):
        assert wanted in names
    assert not [name for name in names if name.startswith("cell/models/") and name.endswith(".py")]
