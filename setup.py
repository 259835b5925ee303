"""What the metadata has from the file OWNER: addresses, and links of the README."""

import re
from pathlib import Path

from setuptools import setup

ROOT = Path(__file__).parent
HOME = f"https://github.com/{(ROOT / 'OWNER').read_text().strip()}/shipgym"
FILES = f"{HOME}/blob/main/"
PICTURES = f"{HOME}/raw/main/"

readme = (ROOT / "README.md").read_text(encoding="utf-8")
readme = re.sub(r"(!\[[^]]*\]\()(?!http)", rf"\1{PICTURES}", readme)
readme = re.sub(r"(\]\()(?!http|#)", rf"\1{FILES}", readme)
setup(
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
