"""`drive`: one episode to look at, in the proxy and beside it in the target, under the same seed."""

import argparse

from rich.console import Group
from rich.text import Text

from proxytune import study
from proxytune.api import choose_theta
from proxytune.cli.options import study_folder
from proxytune.cli.terminal import Answer, waiting
from proxytune.domain import DomainFamily, make_episode
from proxytune.errors import InputError
from proxytune.report import NO_PLACES, check_episode_file, episode_document, episode_text, say_parting, write_episode
from proxytune.seeds import episode_seed
from proxytune.settings import check_whole


def run(arguments: argparse.Namespace) -> Answer:
    """Drive the episode on every side, and draw it if that is asked for."""
    settings = study.read_study_settings(study_folder(arguments.path))
    family = study.load_family(settings, settings.proxy)
    _check(arguments, family)
    model, option = (arguments.against, "--against") if arguments.against else (settings.truth, "truth")
    if model:
        study.check_robot(family, model, option)
    target = study.load_family(settings, model) if model else None
    theta, origin = choose_theta(arguments.theta, settings, family, "--theta")
    seed = settings.seed if arguments.seed is None else arguments.seed
    study.check_episode(family, arguments.agent, theta, arguments.start)
    own_seed = episode_seed(seed, arguments.start)
    episode = make_episode(theta, agent=arguments.agent, start=arguments.start, seed=own_seed)
    with waiting("driving"):
        pair = study.drive_side_by_side(episode, proxy=family, target=target, filmed=arguments.output is not None)
    compared = [metric.name for metric in settings.metrics]
    if arguments.output:
        write_episode(pair, compared, arguments.output)
    files = {"against": str(model) if model else None, "output": str(arguments.output) if arguments.output else None}
    cautions = list(dict.fromkeys(line for side in (family, target) if side for line in study.cautions_of(side)))
    document = {**episode_document(pair, seed), "theta_from": origin, **files, "cautions": cautions}
    agent, start = pair.episode.agent, pair.episode.start
    own = agent in settings.agents and start < settings.starts and seed == settings.seed
    against = "none to drive in, as study.toml names no `truth`; --against MODEL gives one"
    values = ", ".join(f"{name}={value:.4g}" for name, value in sorted(theta.items()))
    words = {"best": "proxy: the study's best θ", "nominal": "proxy: the nominal θ", "given": "proxy: the θ given"}
    about = [
        *(f"beware: {line}" for line in cautions),
        f"{agent} from start {start} under seed {seed}, as in {'every' if own else 'no'} trial of this study",
        f"{words[origin]}{': ' if values else ''}{values}",
        f"target: {f'{model}, under the same seed' if model else against}",
        "",
    ]
    below = ["", *(line for line in (say_parting(pair), files["output"]) if line)]
    return Answer(document, Group(Text("\n".join(about)), episode_text(pair, compared), Text("\n".join(below))))


def _check(arguments: argparse.Namespace, family: DomainFamily) -> None:
    if arguments.seed is not None:
        check_whole("--seed", arguments.seed)
    if arguments.output:
        check_episode_file(arguments.output)
        if not study.can_record(family):
            raise InputError(f"--output {arguments.output}: {NO_PLACES}; leave the option out to see its metrics")
