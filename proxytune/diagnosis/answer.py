"""The answer that both parts of a diagnosis give, motion and camera: estimates, verdicts, and the rules they go by.

Each part fits the declared model, selects the effects that it lacks, drops those that are negligible, and compares
the error before and after on data that was not fitted. Both then say one of five words (`verdict`). Every threshold
that decides what is named, believed or told of motion is one of `Rules`: a diagnosis takes them as an argument, and its
drives carry them (`Drives.rules`), so that one may ask what another rule would have said.
What makes the arithmetic work or keeps it quick (steps, grids, numbers of draws) stands beside the arithmetic; what
makes a log unusable stands beside the checks of logs.
"""

from collections.abc import Callable
from dataclasses import dataclass

Progress = Callable[[str], None]
"""Takes a line about each step, for people who wait."""


@dataclass(frozen=True)
class Estimate:
    """A parameter's fitted value with its 95 % interval."""

    value: float
    interval: tuple[float, float]
    unit: str


def verdict(explained: bool | None, *, named: bool) -> str:
    """Give one of five answers: whether noise alone is left (None: it cannot be told), and effects were named."""
    if explained is None:
        return "cannot be told"
    if explained:
        return "explained" if named else "nothing missing"
    return "partly explained" if named else "unexplained"


@dataclass(frozen=True)
class Rules:
    """Thresholds of a diagnosis of motion.

    Nats are of log-likelihood on blocks that were not fitted; shares lie in [0, 1].
    """

    p_value: float = 0.01
    """Chance of an effect as good without anything missing, over all effects and forms: one log in a hundred. The
    smallest value that 499 draws can show is 0.002."""

    least_gain_nats: float = 15.0
    """Evidence that an effect needs. On logs that lack nothing even the most flexible curve gains less (tested)."""

    least_gain_share: float = 0.01
    """Evidence that an effect needs, as a share of all gained before: less may only mend the form of those effects."""

    sure_gain_nats: float = 300.0
    """Evidence of a car's effect that is not held against chance, which cannot be drawn while much else is missing."""

    least_random_gain_nats: float = 30.0
    """Evidence that a random effect needs: twice as much, for its chance is drawn from shifted innovations, roughly."""

    least_spread_ticks: float = 2.0
    """Commands must be late by times that differ by more ticks of the model: it has a command begin with a tick, and a
    robot without jitter whose motors take 1.6 s to full speed seems to have one of up to 1.9."""

    most_left_of_commands: float = 2.5
    """What a random effect of a car may leave of its commands' pulls [standard deviations]. Planted losses and jitter
    leave 0.4 to 1.7; what else the model lacks pulls both ways, early and late, and much remains: 4 to 6 on DART."""

    most_effects: int = 5
    """Effects that may be adopted: a search that goes astray ends."""

    most_effects_of_cars: int = 10
    """Those of a car: its nominal figures say neither how throttle becomes speed nor how steering becomes an angle."""

    curve_factor: float = 1.2
    curve_margin_nats: float = 30.0
    """A curve over a signal is believed over named effects if it gains by this factor more, and by so many nats. It has
    more weights than any effect, and some lead over a right but idealised name is usual."""

    share_of_curve: float = 0.3
    """Beside such a curve an effect is still added if it gains this share of it, but never as the first effect: that
    one might be wrong altogether."""

    plain_share: float = 0.8
    """Two wheels alike are preferred to one odd wheel if that gains this share: the simpler claim."""

    inside_share: float = 0.8
    """An effect within its range is preferred to one at an end of it if it gains this share and predicts no worse: a
    value at an end stands for something else."""

    edge_share: float = 0.01
    """A value this near to an end of its range, as a share of the range, is at the end: fits stop just short of it."""

    patch_share: float = 0.9
    """A patch of floor that holds more of the driven places than this is no patch: the effect is then everywhere."""

    guard_horizon_s: float = 2.0
    guard_factor: float = 1.05
    """An effect is not adopted, whatever its evidence in single steps, if the error over windows of this horizon [s] is
    shown to be larger by more than this factor: what would make an effect material, the other way round."""

    rival_nats: float = 3.0
    """Effects closer than this in evidence are rivals: odds of 20 to 1 are not enough to name one alone."""

    rival_cosine: float = 0.95
    """Effects are rivals if their changes of the innovations point the same way by this cosine."""

    rival_share: float = 0.7
    """Effects are rivals if the second has this share of the evidence and predicts no worse. On long logs two
    effects that predict alike can lie many nats apart."""

    material_factor: float = 1.05
    """An effect matters if the error without it is shown to be larger, by this factor at some horizon. In the drives
    this was set on, effects of no matter lay between 0.97 and 1.02, the weakest true one at 1.16."""

    ratio_p_value: float = 0.025
    """Chance (one-sided, signed ranks of blocks) below which a ratio of errors is shown to be off 1: as a 95 %
    interval has it."""

    fewest_blocks: int = 3
    """Blocks with a window of a horizon, for errors at it to be told: fewer give no interval."""

    multistep_helps: float = 0.98
    multistep_harms: float = 1.02
    """Parameters fitted to windows are taken if they bring the held-out error beneath the first share at some horizon,
    and above the second at none. Where they change nothing, single steps tell the parameters more sharply."""

    visible_nats: float = 10.0
    """Drives could have shown an effect if its middle probe changes the log-likelihood by so much."""

    struck_share: float = 0.1
    """The share of commands that a random effect of usual size is taken to strike, to say whether it would be seen."""

    robot_drives: int = 2
    robot_share: float = 0.3
    """Each of two robots in one log has at least so many drives and this share of them all: a few drives may be alike
    by their commands."""

    robot_gain_apart: float = 0.04
    """Robots whose wheels' gains differ by less are one robot, on another floor or another charge perhaps."""

    robot_gap: float = 4.0
    """Two groups of drives are two robots if their gap is so many times the spread within a group, and the deviation
    of one drive's gain."""

    discrepancy_blocks: int = 6
    """Blocks without which no curve is learnt: its held-out error would have no interval to speak of."""

    group_share: float = 0.02
    group_t: float = 2.3
    """A group of learnt curves is added if it takes away this share of the held-out squared error, and its logarithm
    falls by so many standard errors: of thirty groups of no use one is, every other time."""

    rare_group_share: float = 0.1
    """Where nothing is learnt so, a group is added too that takes away this share: what acts in few drives is not sure
    in most of them."""

    discrepancy_helps: float = 0.95
    discrepancy_harms: float = 1.02
    """Learnt curves are used if they bring the held-out error beneath the first share at some horizon, and above the
    second at none. More is asked of them than of parameters, for they have many more weights."""

    doubtful_names: float = 0.95
    """Names are doubtful if curves beside the declared effects alone bring the error beneath this share of that with
    names and curves."""

    match_share: float = 0.9
    """A name is told for learnt curves if it alone keeps this share of their gain."""

    floor_factor: float = 1.15
    """An error of no more than so many times the floor is at the floor: the floor is an estimate too."""

    narrow_bracket: float = 1.5
    """All is explained only within a bracket of the floor whose upper end is at most so many times its lower one."""

    known_bracket: float = 3.0
    """Repeated drives explain all only where they leave the floor's ends no further apart than this: a wider bracket
    knows nothing."""

    lowest_by_chance: float = 1.03
    """The lowest of several errors is by chance lower than that of the right model, by no more than this factor."""

    lowers: float = 0.95
    """A model lowers the error if it brings it to this share: the inverse of what makes an effect material."""

    repeats_alike: float = 1.3
    """Repeated drives speak for all drives if the error is at most so many times what they do not repeat: a manoeuvre
    that never meets what is missing is repeated well, too."""

    def at_end(self, value: float, span: tuple[float, float], *harmless: float) -> bool:
        """Tell whether a value lies at an end of its range; an end where the effect vanishes is harmless."""
        reach = self.edge_share * (span[1] - span[0])
        return any(abs(value - end) <= reach for end in span if end not in harmless)


RULES = Rules()
"""The rules that every diagnosis goes by."""
