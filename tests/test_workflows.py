"""What runs on GitHub is what is run here: the gate, and the commands of README.md elsewhere."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from ruamel.yaml import YAML

ROOT = Path(__file__).parent.parent
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*"))
CI = ROOT / ".github" / "workflows" / "ci.yml"


def faults_of(workflow: Path) -> str:
    words = ["check_jsonschema", "--builtin-schema", "vendor.github-workflows", str(workflow)]
    done = subprocess.run([sys.executable, "-m", *words], capture_output=True)
    return (done.stdout + done.stderr).decode() if done.returncode else ""


@pytest.mark.slow
def test_the_workflows_are_what_github_takes(tmp_path: Path):
    assert [workflow.name for workflow in WORKFLOWS] == ["ci.yml"]
    assert faults_of(CI) == ""
    wrong = tmp_path / "ci.yml"
    wrong.write_text(CI.read_text(encoding="utf-8").replace("runs-on:", "runs_on:"), "utf-8")
    assert "runs-on" in faults_of(wrong)


def test_they_run_the_gate_and_the_commands_of_the_readme():
    jobs = YAML(typ="safe").load(CI.read_text(encoding="utf-8"))["jobs"]
    runs = {
        name: [step["run"] for step in job["steps"] if "run" in step] for name, job in jobs.items()
    }
    block = (ROOT / "README.md").read_text(encoding="utf-8").split("```sh\n")[1].split("```")[0]

    assert runs == {"gate": ["bash .ci/run"], "readme": block.splitlines()}
    assert jobs["readme"]["strategy"]["matrix"]["os"] == ["macos-latest", "windows-latest"]
