"""Everything that proxytune raises on purpose, each message one line a person can act on.

    ProxytuneError
    ├── InputError           what was given cannot be used (exit status 2)
    │   ├── ScoresError      a table of scores
    │   ├── SettingsError    a study.toml, model.toml or robot.toml
    │   ├── LogError         a log of commands and poses
    │   ├── LearnerError     samples or weights that a learner cannot use
    │   ├── ExtensionError   code named by the user, or a plug-in
    │   └── ConformanceError an extension breaks a promise (proxytune.testing)
    └── RunError             something failed on the way (exit status 1)
        ├── EpisodeError     an agent or a domain failed in one episode
        ├── StoreError       study.db cannot be read or written
        └── BusyError        another process is running the same study

The command line turns each into one line on standard error and the exit status above.
"""


def to_install(extra: str) -> str:
    """What installs a group of optional libraries; proxytune itself is on no index."""
    return f'pip install ".[{extra}]" in the checkout of proxytune'


class ProxytuneError(Exception):
    """Anything that proxytune reports to its user in one line."""


class InputError(ProxytuneError):
    """Something given cannot be used; the message says what to change."""


class ScoresError(InputError):
    """A table of scores is incomplete, malformed or does not match its partner."""


class SettingsError(InputError):
    """A settings file has a missing, unknown or impossible key."""


class LogError(InputError):
    """A log of commands and poses is malformed or cannot bear the question asked."""


class LearnerError(InputError):
    """Samples or weights that a learner cannot use."""


class ExtensionError(InputError):
    """Code that a user names, or a plug-in, cannot be found, imported, or is not what it should be."""


class ConformanceError(InputError, AssertionError):
    """An extension does not keep what its protocol promises; to a test runner, an assertion that failed."""


class RunError(ProxytuneError):
    """Something failed while running; what had been finished is kept."""


class EpisodeError(RunError):
    """An agent or a domain failed within one episode."""


class StoreError(RunError):
    """A study's database cannot be read or written."""


class BusyError(RunError):
    """Another process is running the same study."""
