"""Which column of a table is what: as a map says, else by its name."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from proxytune.errors import LogError
from proxytune.importing.source import Channel, Floats
from proxytune.importing.tables.cells import Table
from proxytune.importing.tables.fields import EXAMPLE, QUANTITIES, QUATERNION, USUAL
from proxytune.importing.tables.units import Unit, contradiction, epoch_unit, own_unit, split_ending, split_unit
from proxytune.logs import COMMANDS
from proxytune.settings import nearest


@dataclass(frozen=True)
class Column:
    """A column of a table and what it is taken for.

    Attributes:
        field: The package's name of it.
        name: The table's name of it.
        unit: The unit of its values.
        known_by: How the unit is known: "stated", "by its name", "by its size" or "assumed".
    """

    field: str
    name: str
    unit: Unit
    known_by: str

    def __str__(self) -> str:
        if self.unit.quantity == "number":
            return f"{self.field} from '{self.name}'"
        return f"{self.field} from '{self.name}' ({self.unit.name}, {self.known_by})"


Columns = Mapping[str, Column]


def own_columns(names: Sequence[str]) -> dict[str, Column]:
    """Columns that have the package's names and units."""
    return {name: Column(name, name, own_unit(QUANTITIES[name]), "stated") for name in names}


def usual_names(field: str, names: Sequence[str]) -> list[str]:
    """Those names that are usual for a field."""
    stems = {name: split_ending(name, QUANTITIES[field])[0].removeprefix("field_") for name in names}
    return [name for name, stem in stems.items() if stem.replace("_", "") in USUAL[field]]


def choose_columns(table: Table, stated: Mapping[str, str], fields: Sequence[str]) -> dict[str, Column]:
    """Find the columns of some fields.

    Args:
        table: The table.
        stated: Entries of a column map, by field; a field that it leaves out is looked for by its usual names.
        fields: What may be looked for.

    Raises:
        LogError: If a stated column is not there, or two columns may be the same field.
    """
    chosen = {field: _stated(table, field, stated[field]) for field in fields if field in stated}
    if "heading" in chosen:
        fields = [field for field in fields if field not in QUATERNION]
    taken = {column.name for column in chosen.values()}
    for field in fields:
        column = None if field in chosen else _usual(table, field, taken)
        if column:
            chosen[field] = column
    if set(QUATERNION) <= set(chosen) and "heading" not in stated:
        chosen.pop("heading", None)
    return {field: _of_an_epoch(table, column) for field, column in chosen.items()}


def check_fields(stated: Mapping[str, str], where: str) -> None:
    """Refuse a column map that names something else than the package's fields.

    Raises:
        LogError: If it does.
    """
    for field in stated:
        if field not in QUANTITIES:
            raise LogError(f"{where}: column map: unknown name '{field}'; {nearest(field, QUANTITIES)}")


def column_values(table: Table, column: Column) -> Floats:
    """The values of a column in the package's unit (N,), NaN where a cell is empty.

    Raises:
        LogError: If a cell is no number, or the values contradict a unit that was not stated.
    """
    values = table.numbers(column.name)
    problem = contradiction(column.unit, values) if column.known_by in ("assumed", "by its name") else ""
    if problem:
        raise LogError(
            f"{table.path}: column '{column.name}' as {column.field} in {column.unit.name} ({column.known_by}): "
            f"{problem}; state its unit, as in --columns {column.field}={column.name}:{column.unit.name}"
        )
    return values * column.unit.factor


def missing(table: Table, fields: Sequence[str]) -> LogError:
    """The complaint about fields that no column was found for."""
    return LogError(
        f"{table.path}: no column found for {', '.join(fields)}; its columns are: {', '.join(table.names)}; "
        f"say which is which, as in {EXAMPLE}"
    )


def command_kind(columns: Columns, kind: str, table: Table) -> str:
    """The kind of the commands that a table holds.

    Args:
        columns: The columns that were found.
        kind: The kind asked for, or "".
        table: The table.

    Raises:
        LogError: If it holds none, half of a pair, or several kinds and none is asked for.
    """
    kinds = [name for name, pair in COMMANDS.items() if pair and set(pair) <= set(columns) and kind in ("", name)]
    stated = [name for name in kinds if all(columns[field].known_by == "stated" for field in COMMANDS[name])]
    kinds = stated if len(stated) == 1 else kinds
    if len(kinds) > 1:
        either = " or ".join(kinds)
        raise LogError(f"{table.path}: its commands may be {either}; choose one, as in --kind {kinds[0]}")
    if kinds:
        return kinds[0]
    pairs = [COMMANDS[kind]] if kind in COMMANDS else [pair for pair in COMMANDS.values() if set(pair) & set(columns)]
    lacking = [field for pair in pairs for field in pair if field not in columns]
    raise missing(table, lacking or ["commands (v and omega, or left and right)"])


def holds_commands(columns: Columns) -> bool:
    """Whether there is a column of any kind of command."""
    return any(set(pair) & set(columns) for pair in COMMANDS.values())


def named_in(table: Table, entry: str) -> bool:
    """Whether an entry of a column map names a column of a table."""
    return entry in table.names or entry.rpartition(":")[0] in table.names


def described(columns: Columns) -> str:
    """What was taken for what."""
    return ", ".join(str(column) for column in columns.values())


def channels_of(table: Table, columns: Columns) -> list[Channel]:
    """All columns of a table and what each was taken for."""
    fields = {column.name: column.field for column in columns.values()}
    return [Channel(name, "column", table.filled(name), fields.get(name, "left out")) for name in table.names]


def _stated(table: Table, field: str, entry: str) -> Column:
    where = f"{table.path}: column map: {field}={entry}"
    name, unit = split_unit(entry, QUANTITIES[field], table.names, where)
    if name not in table.names:
        raise LogError(f"{where}: has no column '{name}'; {nearest(name, table.names)}")
    if unit:
        return Column(field, name, unit, "stated")
    return _by_ending(field, name)


def _by_ending(field: str, name: str) -> Column:
    _, unit = split_ending(name, QUANTITIES[field])
    return Column(field, name, unit or own_unit(QUANTITIES[field]), "by its name" if unit else "assumed")


def _usual(table: Table, field: str, taken: set[str]) -> Column | None:
    """The one column whose name is usual for a field."""
    names = [name for name in usual_names(field, table.names) if name not in taken]
    if len(names) > 1:
        either = " or ".join(f"'{name}'" for name in names)
        raise LogError(f"{table.path}: {field} may be {either}; say which, as in --columns {field}={names[0]}")
    return _by_ending(field, names[0]) if names else None


def _of_an_epoch(table: Table, column: Column) -> Column:
    """Stamps whose unit nobody gave, taken for those since 1970 where they are too large for seconds."""
    if column.field != "time" or column.known_by != "assumed":
        return column
    unit = epoch_unit(table.numbers(column.name))
    return replace(column, unit=unit, known_by="by its size") if unit else column


def summed(parts: Sequence[Sequence[Channel]]) -> tuple[Channel, ...]:
    """Columns of several files, those of equal name and role as one."""
    counts: dict[tuple[str, str], int] = {}
    for channel in (channel for part in parts for channel in part):
        key = channel.name, channel.role
        counts[key] = counts.get(key, 0) + channel.count
    return tuple(Channel(name, "column", count, role) for (name, role), count in counts.items())
