"""Read every published pair of tables again: one page, and the table in docs.

    python studies/published/page.py [PAGE.html [TABLE.md]]

Tasks of one pair are averaged, as the audit that recovered the tables does; on a page the pairs are sorted by what can
be claimed of them.
"""

import csv
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import proxytune
from proxytune.report import Paragraphs, Picture, Table, View, columns_of, foot_of, svg_of, write_page
from proxytune.scores import ScoreTable
from proxytune.usefulness import mmrv_conventions

HERE = Path(__file__).resolve().parent
CLAIMS = (
    "the ranking is more than chance, and the simulator's winner is the robot's",
    "the ranking is more than chance, and yet the simulator's winner is not the robot's, or ties with one that is not",
    "the simulator's winner is the robot's, and chance explains the ranking",
    "chance explains the ranking, and the simulator's winner is not the robot's",
    "nothing can be ranked",
)


@dataclass(frozen=True)
class Pair:
    """A published pair with what is said of it; `score` is None where it cannot be scored, for the reason given."""

    name: str
    paper: str
    arxiv: str
    claim: int
    score: proxytune.ScoreReport | None
    cells: tuple[str, ...]
    sentence: str


def read(name: str, paper: str, arxiv: str, rollouts: int | None) -> Pair:
    """Score one pair: the ranking by the mean of its tasks, the decision by all of them."""
    header = next(csv.reader((HERE / name / "target.csv").open(encoding="utf-8")))
    metrics = [f"{task}:max" for task in header if task not in ("agent", "episode")]
    tables = [
        proxytune.read_scores(HERE / name / f"{side}.csv", [m[:-4] for m in metrics]) for side in ("proxy", "target")
    ]
    if len(tables[1].agents) < 2:
        return Pair(name, paper, arxiv, 4, None, ("1", *("–",) * 9), "One policy alone: there is nothing to rank.")
    by_task = dict(zip(("proxy", "target"), (table.unpaired() for table in tables), strict=True))
    decided = proxytune.score(**by_task, metrics=metrics, rollouts=rollouts, decide_on="mean").decision
    if name == "worldgym":  # its labels name tasks
        whole = dict(zip(("proxy", "target"), tables, strict=True))
        decided = proxytune.score(**whole, metrics=metrics).decision
    averaged = {side: average(table) for side, table in by_task.items()}
    found = proxytune.score(**averaged, metrics="success:max")
    observed, chance = decided.observed, found.chance
    claim = (0 if observed.agrees else 1) if not chance.explains else (2 if observed.agrees else 3)
    winner = observed.proxy_winners[0]
    r = found.srcc.value["success"]
    best, risk = decided.best_probabilities, decided.expected_regret[winner]
    right = sum(panel.agrees is True for panel in decided.without)
    cells = (
        str(len(found.inputs.agents)), str(max(1, len(decided.tasks))),
        f"{found.prpv.value} of {found.prpv.range[1]}", f"{chance.p_value:.3g}{'' if chance.exact else ' (drawn)'}",
        "–" if r is None else f"{r:.3f}",
        {True: "yes", False: "no", None: "tie"}[observed.agrees], f"{observed.regret:.3g}",
        f"{right} of {len(decided.without)}" if decided.without else "–",
        "–" if best is None else f"{best[winner]:.3g}", "–" if best is None else f"{risk:.3g}",
    )  # fmt: skip
    says = " ".join(found.sentence.split("Deploy")[0].split("By the means")[0].split()).replace("proxy has", "it has")
    convention = mmrv_conventions(found.inputs)["success"]
    said = ", ".join(f"{key.replace('_', ' ')} {value:.3g}" for key, value in convention.items())
    return Pair(name, paper, arxiv, claim, found, cells, f"{says} Winner in the proxy: {winner}. MMRV: {said}.")


def average(table: ScoreTable) -> ScoreTable:
    """The mean of an agent's tasks in each of its episodes."""
    return ScoreTable(table.agents, table.episodes, ("success",), np.asarray(table.values.mean(axis=2, keepdims=True)))


HEADS = (
    "policies", "tasks", "PRPV", "p by chance", "r", "winner agrees", "regret", "one task left out",
    "P(its winner is best)", "expected regret",
)  # fmt: skip


def main(page: Path, markdown: Path | None) -> None:
    """Score all, write the page and the table."""
    with (HERE / "sources.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    pairs = [read(row["table"], row["paper"], row["arxiv"], int(row["rollouts"] or 0) or None) for row in rows]
    pairs.sort(key=lambda pair: (pair.claim, pair.name))
    chance = sum(pair.claim in (2, 3) for pair in pairs)
    wrong = sum(pair.claim in (1, 3) for pair in pairs)
    sentence = (
        f"Of {len(pairs)} published pairs of tables, chance explains the ranking in {chance}; in {wrong} the "
        "simulator's winner is not the robot's, or ties with one that is not."
    )
    table = [(pair.name, f"{pair.paper}, arXiv {pair.arxiv}", *pair.cells) for pair in pairs]
    parts: list[Table | Picture | Paragraphs] = [
        Table("All pairs, by what can be claimed", columns_of(("table", "source"), HEADS), tuple(table))
    ]
    for place, claim in enumerate(CLAIMS):
        own = [pair for pair in pairs if pair.claim == place]
        parts.append(
            Paragraphs(f"{claim[0].upper()}{claim[1:]}: {len(own)}", tuple(f"{p.name}: {p.sentence}" for p in own))
        )
        for pair in own:
            if pair.score is not None:
                source = f"{pair.paper}, arXiv {pair.arxiv}; numbers recovered by Tri Lam's audit (CC BY 4.0)."
                parts.append(Picture(pair.name, svg_of(pair.score.figures()["scatter"]), source))
    next_step = "score your own two tables: `python -m proxytune score --proxy sim.csv --target real.csv`."
    write_page(
        page,
        View("Published scores, read again", sentence, next_step, tuple(parts)),
        foot_of("python studies/published/page.py"),
    )
    if markdown is not None:
        lines = [f"| table | source | {' | '.join(HEADS)} |", "|" + "---|" * (len(HEADS) + 2)]
        lines += [f"| {' | '.join(cells)} |" for cells in table]
        markdown.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print(sentence)


if __name__ == "__main__":
    main(
        Path(sys.argv[1] if len(sys.argv) > 1 else HERE / "report.html"),
        Path(sys.argv[2]) if len(sys.argv) > 2 else None,
    )
