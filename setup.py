"""What pyproject.toml cannot say: metadata from OWNER, and the papers in the wheel."""

import re
import shutil
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

ROOT = Path(__file__).parent
HOME = f"https://github.com/{(ROOT / 'OWNER').read_text().strip()}/shipgym"
FILES = f"{HOME}/blob/main/"
PICTURES = f"{HOME}/raw/main/"

readme = (ROOT / "README.md").read_text(encoding="utf-8")
readme = re.sub(r"(!\[[^]]*\]\()(?!http)", rf"\1{PICTURES}", readme)
readme = re.sub(r"(\]\()(?!http|#)", rf"\1{FILES}", readme)


class WithPapers(build_py):
    """Puts what `shipgym reproduce` runs beside the package `agents`."""

    def run(self):  # noqa: D102
        super().run()
        if not self.editable_mode:
            here, there = ROOT / "scripts", Path(self.build_lib) / "agents" / "scripts"
            ignored = shutil.ignore_patterns("__pycache__")
            shutil.copytree(
                here / "papers", there / "papers", ignore=ignored, dirs_exist_ok=True
            )
            shutil.copy(here / "reproduce.py", there)


setup(
    cmdclass={"build_py": WithPapers},
    long_description=readme,
    long_description_content_type="text/markdown",
    url=HOME,
    project_urls={
        "Documentation": f"{HOME}/tree/main/docs",
        "Source": HOME,
        "Issues": f"{HOME}/issues",
        "Changelog": f"{FILES}CHANGELOG.md",
    },
)
