"""A bag, or a folder of bags, as drives with commands, poses and pictures."""

from dataclasses import replace
from pathlib import Path

from proxytune.errors import LogError
from proxytune.importing.ros.bag import Bag, Topic, bags_in, form_of, open_bag
from proxytune.importing.ros.choice import Choice, channels_of, choose, notes_of
from proxytune.importing.ros.composing import read_chain
from proxytune.importing.ros.messages import read_commands, read_poses
from proxytune.importing.ros.pictures import read_pictures
from proxytune.importing.ros.roles import TRANSFORMS
from proxytune.importing.ros.transforms import choose_transform, read_transforms
from proxytune.importing.source import Drive, Poses, Source
from proxytune.importing.wanted import Wanted

Notes = tuple[str, ...]


def read_bag(path: Path, wanted: Wanted) -> Source:
    """Read a ROS bag, or a folder of bags with a drive each, of the same topics.

    Args:
        path: A ROS 1 file, a ROS 2 folder or storage file (sqlite3 or mcap), or a folder of such.
        wanted: Topics and stamps to take.

    Raises:
        LogError: If a bag cannot be read, or there is nothing that can be commands or poses.
    """
    bags = bags_in(path)
    topics, notes = _list(path, bags)
    choice = choose(topics, wanted, f"{path}")
    if choice.of_transforms and not choice.transform:
        choice = _with_transform(choice, next(iter(bags.values())), wanted)
    drives = []
    notes = [*notes_of(topics, choice), *notes]
    for name, bag in bags.items():
        drive, said = _read_drive(name, bag, choice, wanted)
        drives.append(drive)
        notes += said if len(bags) == 1 else [f"{name}: {note}" for note in said]
    return Source(_form(bags), tuple(drives), channels_of(topics, choice), tuple(dict.fromkeys(notes)))


def _list(path: Path, bags: dict[str, Path]) -> tuple[tuple[Topic, ...], list[str]]:
    """The topics of all bags together; one that a bag lacks counts as without messages there."""
    listed, notes = [], []
    for bag_path in bags.values():
        with open_bag(bag_path) as bag:
            if not bag.reader.message_count:
                raise LogError(f"{bag_path}: holds no messages; record it again, or leave it out")
            listed.append({topic.name: topic for topic in bag.topics})
            if not bag.defines_types:
                notes.append(f"{bag_path.name} does not define its types of message: those of ROS 2 Humble were taken.")
    names = sorted({name for topics in listed for name in topics})
    return tuple(_merge([topics[name] for topics in listed if name in topics], len(bags)) for name in names), notes


def _merge(topics: list[Topic], bags: int) -> Topic:
    """A topic of several bags as one."""
    one = topics[0]
    lacking = bags - sum(topic.count > 0 for topic in topics)
    kind = one.kind if len({topic.kind for topic in topics}) == 1 else "several types"
    known = all(topic.known for topic in topics)
    return Topic(one.name, kind, sum(topic.count for topic in topics), known, lacking)


def _with_transform(choice: Choice, path: Path, wanted: Wanted) -> Choice:
    """The choice with the transform that the first bag's pose is."""
    with open_bag(path) as bag:
        transforms = read_transforms(bag, _transform_topics(bag))
        return replace(choice, transform=choose_transform(transforms, f"{path}: {choice.poses.name}"))


def _read_drive(name: str, path: Path, choice: Choice, wanted: Wanted) -> tuple[Drive, list[str]]:
    """One bag as a drive, and what there is to say of it."""
    commands, pictures = None, None
    said: list[str] = []
    with open_bag(path) as bag:
        if choice.commands is not None:
            commands, notes = read_commands(bag, choice.commands.name, choice.kind, wanted.stamps)
            said += notes
        poses, notes = _read_poses(bag, choice, wanted)
        said += notes
        if choice.pictures is not None:
            pictures, notes = read_pictures(bag, choice.pictures.name, wanted.stamps)
            said += notes
    return Drive(name, commands, poses, pictures), said


def _read_poses(bag: Bag, choice: Choice, wanted: Wanted) -> tuple[Poses, Notes]:
    if not choice.of_transforms:
        return read_poses(bag, choice.poses.name, wanted.stamps)
    transforms = read_transforms(bag, _transform_topics(bag))
    return read_chain(transforms, choice.transform, wanted.stamps, f"{bag.path}: {choice.poses.name}")


def _transform_topics(bag: Bag) -> tuple[str, ...]:
    return tuple(topic.name for topic in bag.topics if topic.kind in TRANSFORMS and topic.known)


def _form(bags: dict[str, Path]) -> str:
    forms = sorted({form_of(bag) for bag in bags.values()})
    return forms[0] if len(bags) == 1 else f"{len(bags)} bags: {', '.join(forms)}"
