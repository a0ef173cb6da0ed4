"""Which learner it was: a digest under which what it has learnt is kept."""

import hashlib
import inspect
import sys
from pathlib import Path

from proxytune.learning.learner import Learner
from proxytune.meaning import meaning_of


def learner_identity(learner: Learner) -> str:
    """A digest of a learner's settings, as its `repr` tells them, and of what its code means.

    Its code is its class's module and the modules in the same folder from which that has taken classes or functions.
    """
    module = sys.modules[type(learner).__module__]
    source = Path(inspect.getfile(type(learner)))
    taken = {getattr(value, "__module__", None) for value in vars(module).values()}
    files = {Path(file) for name in taken if (file := getattr(sys.modules.get(str(name)), "__file__", None))}
    code = meaning_of({source, *(file for file in files if file.parent == source.parent)}, source.parent)
    return hashlib.sha256(code.encode() + repr(learner).encode()).hexdigest()[:16]
