"""A domain family to start from: a tiny simulator with all that a study asks of one."""

from proxytune.skeletons.skeleton import Skeleton, fill
from proxytune.skeletons.study import commands

PAGE = "docs/extending.md"


def family_skeleton(name: str) -> Skeleton:
    """A module, a study of it, a truth.toml and a test.

    Args:
        name: Of the folder and of the module in it; a Python name.
    """
    templates = {
        f"{name}.py": "family.py.txt",
        "study.toml": "family_study.toml.txt",
        "truth.toml": "family_truth.toml.txt",
        f"test_{name}.py": "family_test.py.txt",
    }
    files = {file: fill(template, name=name, page=PAGE) for file, template in templates.items()}
    note = f"put your simulator where {name}.py says EDIT ({PAGE}, 'Another simulator')"
    return Skeleton(files, (*commands(name), f"PYTHONPATH={name} python -m pytest {name}/test_{name}.py"), (note,))
