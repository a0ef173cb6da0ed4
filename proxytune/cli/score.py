"""`score`: how useful proxies are as predictors, from tables of scores, as they are named on the command line."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from proxytune import report, scores, usefulness
from proxytune.cli.options import typed
from proxytune.cli.terminal import Answer
from proxytune.errors import InputError
from proxytune.files import check_place
from proxytune.settings import nearest, pairs_in


def read_sides(
    arguments: argparse.Namespace, metrics: Sequence[str]
) -> tuple[tuple[str, scores.ScoreTable], dict[str, scores.ScoreTable]]:
    """The target with its name, and every proxy by name."""
    columns = pairs_in("--columns", arguments.columns, "NAME=COLUMN,..., as in agent=policy,episode=trial")
    files = [split_source(source)[0] for source in (*arguments.target, *arguments.proxy)] if columns else []
    found = list(dict.fromkeys(name for path in files for name in scores.column_names(path)))
    for name, theirs in columns.items():
        if theirs not in found:
            raise InputError(f"--columns {name}={theirs}: no table has a column '{theirs}'; {nearest(theirs, found)}")
    if arguments.both is not None:  # A file that is named as both sides is compared with itself on purpose
        header = scores.column_names(*split_source(arguments.both))
        if split_source(arguments.both)[1] is not None or "domain" not in header:
            scores.check_sides(arguments.both, header, metrics)
    parts = [split_source(source) for source in arguments.target]
    if len({domain for _, domain in parts}) > 1:
        several = "several files make one table; give all of them one domain, or none"
        raise InputError(f"--target {arguments.target[1]}: {several}")
    paths, domain = [path for path, _ in parts], parts[0][1]
    own = "real" if arguments.target == arguments.proxy else ", ".join(path.stem for path in paths)
    target = scores.read_scores(paths, metrics, domain, _present(columns, paths), "target")
    return (domain or own, target), _read_proxies(arguments.proxy, arguments.target, metrics, columns)


def _metrics_given(arguments: argparse.Namespace) -> list[str]:
    """The metrics asked for with patterns resolved, or those that one table has of both sides."""
    path, domain = split_source(arguments.target[0])
    asked = arguments.metric or []
    if asked and not any("*" in text or "?" in text for text in asked):
        return list(asked)
    header = scores.column_names(path, domain)
    if asked:
        return scores.expand(asked, header)
    found = scores.both_metrics(header)
    if not found or not all("success" in name for name in found):
        known = found or [name for name in header if name not in scores.LABELS]
        told = f"; the table has {', '.join(known)[:80]}" if known else ""
        raise InputError(f"--metric is missing: say what is compared and whether more is better, NAME:max{told}")
    return [f"{name}:max" for name in found]


def split_source(source: str) -> tuple[Path, str | None]:
    """Split FILE or FILE:DOMAIN into its parts."""
    path, colon, domain = source.rpartition(":")
    if not colon or Path(source).exists() or not path:
        return Path(source), None
    return Path(path), domain


def _read_proxies(
    sources: Sequence[str], target: Sequence[str], metrics: Sequence[str], columns: Mapping[str, str]
) -> dict[str, scores.ScoreTable]:
    """Every proxy by name: its domain, or its file's name, or what was typed where those are not unique."""
    of_target = dict(map(split_source, target))
    proxies: dict[str, scores.ScoreTable] = {}
    given: set[tuple[Path, str]] = set()
    for source in sources:
        path, domain = split_source(source)
        here = _present(columns, [path])
        if domain:
            tables = {domain: scores.read_scores(path, metrics, domain, here, "proxy")}
        else:
            tables = scores.read_domains(path, metrics, here, "proxy")
        if not domain and len(tables) > 1 and of_target.get(path):
            tables.pop(of_target[path] or "", None)
        for label, table in tables.items():
            name = label or ("sim" if source in target else path.stem)
            name = name if name not in proxies else f"{path}:{label}" if label else str(path)
            if name in proxies or (path, label) in given:
                raise InputError(f"--proxy {source}: is given twice; give each proxy once")
            proxies[name] = table
            given.add((path, label))
    return proxies


def _present(columns: Mapping[str, str], paths: Sequence[Path]) -> dict[str, str]:
    """Those of the column map that these files have: another table may have the names of this program."""
    found = {name for path in paths for name in scores.column_names(path)} if columns else set()
    return {name: theirs for name, theirs in columns.items() if theirs in found}


def _sides_given(arguments: argparse.Namespace) -> None:
    if arguments.both is not None:
        if arguments.proxy or arguments.target:
            raise InputError(f"{arguments.both}: give one table of both sides, or --proxy and --target")
        arguments.proxy = arguments.target = [arguments.both]
    for side in ("proxy", "target"):
        if not getattr(arguments, side):
            raise InputError(f"--{side} is missing: name its scores, or one table of both sides: score TABLE")


def run(arguments: argparse.Namespace) -> Answer:
    """Score one proxy, or rank several."""
    _sides_given(arguments)
    if arguments.table:
        report.check_table_file(arguments.table)
        given = (*arguments.proxy, *arguments.target)
        check_place(arguments.table, inputs=[split_source(source)[0] for source in given])
    if arguments.output:
        check_place(arguments.output, folder=True)
    arguments.metric = _metrics_given(arguments)
    metrics = [scores.Metric.parse(text) for text in arguments.metric]
    (target_name, target), proxies = read_sides(arguments, [metric.name for metric in metrics])
    same = [
        f"{source} is given as the proxy and as the target: what is in it is compared with itself"
        for source in arguments.proxy
        if source in arguments.target and not arguments.both
    ]
    left_out: Sequence[str] = ()
    if arguments.common:
        sides = {"the target": target, **{f"the proxy {name}": one for name, one in proxies.items()}}
        kept, left_out = usefulness.in_common(sides)
        target, proxies = kept.pop("the target"), dict(zip(proxies, kept.values(), strict=True))
    if arguments.unpaired:
        target = target.unpaired()
        proxies = {name: table.unpaired() for name, table in proxies.items()}
    assessments, selection = usefulness.assess_each(
        proxies=proxies,
        target=target,
        metrics=metrics,
        beta=_weights(arguments.beta),
        asked=usefulness.Asked(arguments.decide_on, arguments.rollouts, arguments.regret),
        resamples=arguments.resamples,
        seed=arguments.seed,
    )
    tested = _test(assessments, arguments) if arguments.sequential else None
    document: dict[str, Any] = {"target": target_name, "figures": []}
    if arguments.output:
        settings = [("metrics", ", ".join(arguments.metric)), ("resamples", str(arguments.resamples))]
        foot = report.foot_of(typed(arguments), [*settings, ("seed", str(arguments.seed))])
        drawn = report.write_score_report(assessments, selection, arguments.output, foot, target=target_name)
        document |= {"figures": [str(path) for path in drawn[0]], "report": str(drawn[1])}
    document["left_out"] = list(left_out)
    if arguments.table:
        report.write_score_table(assessments, arguments.table)
        document["table"] = str(arguments.table)
    if tested is not None:
        document["sequential"] = asdict(tested)
    lines = [
        *(f"beware: {line}" for line in same),
        *left_out,
        *([f"sequential test: {report.sequential_sentence(tested)}"] if tested else ()),
    ]
    shown = report.score_text(assessments, selection, lines, target=target_name)
    if selection is not None:
        document |= report.ranking_document(assessments, selection)
    else:
        ((name, assessment),) = assessments.items()
        document = {"proxy": name, **document, **report.score_document(assessment)}
    return Answer(document | {"cautions": [*same, *document["cautions"]]}, shown)


def _test(assessments: Mapping[str, usefulness.Assessment], arguments: argparse.Namespace) -> usefulness.Sequential:
    if len(assessments) > 1:
        raise InputError("--sequential: takes one proxy; name the one to bet by")
    ((_, assessment),) = assessments.items()
    columns, name = usefulness.chosen(assessment.inputs, arguments.decide_on)
    if len(columns) > 1:
        raise InputError(f"--sequential: takes one metric, not the {name}; name it with --decide-on")
    return usefulness.sequential_test(assessment.inputs, columns[0], seed=arguments.seed)


def _weights(texts: Sequence[str]) -> dict[str, float] | None:
    weights: dict[str, float] = {}
    for text in texts:
        name, _, weight = text.rpartition(":")
        try:
            weights[name] = float(weight)
        except ValueError:
            raise InputError(f"--beta {text}: write NAME:WEIGHT, as in distance:0.5") from None
    return weights or None
