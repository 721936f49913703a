"""The code of docs/python.md, block after block."""

from __future__ import annotations

import os
import pathlib
import re
import subprocess
import sys


def test_the_code_of_the_guide_runs(root: pathlib.Path, tmp_path: pathlib.Path) -> None:
    guide = (root / "docs/python.md").read_text()
    blocks = re.findall(r"^```python\n(.*?)^```$", guide, re.MULTILINE | re.DOTALL)
    assert len(blocks) > 5
    [curve] = [block for block in blocks if "plt.plot" in block]
    assert len([line for line in curve.splitlines() if line.strip()]) <= 10
    (tmp_path / "examples").symlink_to(root / "examples")
    # The commands that make the first scenario; the others install packages and show a page.
    [command] = re.findall(r"^bbz (new .*)$", guide, re.MULTILINE)
    subprocess.run([sys.executable, "-m", "bittybuzz", *command.split()], cwd=tmp_path, check=True)
    (tmp_path / "guide.py").write_text("\n".join(blocks))
    # Pictures are drawn without a window.
    environment = {**os.environ, "MPLBACKEND": "Agg", "MPLCONFIGDIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "guide.py"], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "greatest.png").read_bytes().startswith(b"\x89PNG") and (tmp_path / "run.bbr").is_file()


def test_the_guide_names_all_exceptions(root: pathlib.Path) -> None:
    import bittybuzz

    guide = (root / "docs/python.md").read_text()
    for name in bittybuzz.__all__:
        value = getattr(bittybuzz, name)
        if isinstance(value, type) and issubclass(value, bittybuzz.Error) and value is not bittybuzz.Error:
            assert f"| `{name}` |" in guide, name
