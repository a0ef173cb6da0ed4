"""What the figures of a diagnosis are of, and what to see in them."""

from collections.abc import Mapping

from proxytune.report.page.parts import Picture

SAID = {
    "error": (
        "Error of predictions before and after",
        "Errors on drives kept aside, with 95 % intervals, on logarithmic axes. The nearer the model with the effects "
        "added is to the green noise floor, the less is missing. Whether an effect helps at a length is told by the "
        "ratio in the table: its interval should stay below 1.",
    ),
    "effect_curve": (
        "What was added, against what was measured",
        "Grey is what was measured beyond the declared model. The line of the model with the effects added should "
        "follow it; the declared one does not.",
    ),
    "ranking": (
        "Evidence for each effect that was tried",
        "The farther right, the more an effect explains of drives left out. On top those added, in this order, each "
        "with what it explains beyond those above it; below them what others explain alone: light blue ones fit these "
        "drives as well as one that was added. At the bottom: free curves over a signal, which need be no physics.",
    ),
    "learnt": (
        "What was learnt where no named effect explains it",
        "Each curve is what is added to the motion over one signal. It describes these drives and is no physics: "
        "use it only within the range shown.",
    ),
    "residual_over_time": (
        "Where in time predictions stray",
        "On drives, or the later part of each, that nothing was fitted to. A curve that rises within the drives is "
        "something that changes with time, as a battery; one that is level is not.",
    ),
    "residual_map": (
        "Where on the floor predictions stray",
        "Errors that keep to one place are of the floor or of the tracker there, others of the robot. The maps share "
        "one logarithmic scale; arrows point where the robot drove.",
    ),
    "camera_markings": (
        "Markings as the model sees them",
        "Lines are the map's markings as the model projects them. They should lie on the edges in the frame.",
    ),
    "camera_displacement": (
        "How far markings lie from their places",
        "Arrows point from where the model has the markings to where they are. A pattern that is left over is "
        "something fixed to the camera, as its lens or its mounting.",
    ),
    "camera_ranking": (
        "Evidence lost with each effect alone",
        "The farther left, the more an effect explains alone. Those beside the dotted line of “nothing added” "
        "explain nothing.",
    ),
    "camera_error": (
        "Error of the frames before and after",
        "On frames kept aside. The effects added help where their points lie below the declared model's.",
    ),
}
"""Title and caption of each figure, in the order in which they are shown."""


def pictures(figures: Mapping[str, bytes]) -> list[Picture]:
    """The figures that there are, with captions; one without a caption comes last under its own name."""
    known = [Picture(title, figures[name], caption) for name, (title, caption) in SAID.items() if name in figures]
    return [*known, *(Picture(name, image, "") for name, image in figures.items() if name not in SAID)]
