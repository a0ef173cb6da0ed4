"""The maps as figures: where tiles, lanes and markings lie, in metres from the bottom-left corner."""

from dataclasses import dataclass


@dataclass(frozen=True)
class LoopMap:
    """A square loop road: straight tiles along the edges, quarter-circle curves in the corners.

    Attributes:
        name: What `[domain] map` calls it.
        tiles: Tiles along one side.
        tile: Side of a tile [m].
        lane_offset: Distance of a lane's centre line from the road's centre line [m].
        lane_width: Width of a lane [m].
        white_width: Width of the solid white edge lines [m].
        yellow_width: Width of the dashed yellow centre line [m].
        corner_radius: Radius of the yellow line's bend in a corner tile [m], half a tile at most; the white lines'
            bends have the same centre. The lane as it is scored is `lane_offset` from arcs of half a tile.
        straight_dashes: Yellow dashes on a straight tile; every tile begins and ends with a gap.
        corner_dashes: Yellow dashes on a corner tile.
        dash_per_gap: Length of a dash over the length of a gap.
        starts: Starting poses (x [m], y [m], heading [deg]).
    """

    name: str
    tiles: int
    tile: float
    lane_offset: float
    lane_width: float
    white_width: float
    yellow_width: float
    corner_radius: float
    straight_dashes: int
    corner_dashes: int
    dash_per_gap: float
    starts: tuple[tuple[float, float, float], ...]

    @property
    def side(self) -> float:
        """Side of the whole map [m]."""
        return self.tiles * self.tile


SMALL_LOOP = LoopMap(
    name="small_loop",
    tiles=3,
    tile=0.585,
    lane_offset=0.22 * 0.585,
    lane_width=0.22,
    white_width=0.048,
    yellow_width=0.024,
    # Measured on gym-duckietown's frames of photographed tiles: the yellow line passes 0.343 m from the inner corner at
    # 45°, where an arc of half a tile would pass at 0.293 m; dashes 4.3 cm on straight tiles, 5.4 cm on corner tiles
    corner_radius=0.17,
    straight_dashes=9,
    corner_dashes=6,
    dash_per_gap=2.0,
    # Courchesne, Censi, Paull (2021): the ten starts of their evaluation
    starts=(
        (0.4237, 0.702, 104.3),
        (1.5816, 0.702, 54.6),
        (0.1246, 1.053, -72.9),
        (1.5755, 0.702, 101.3),
        (0.702, 0.168, -21.0),
        (1.5908, 0.702, 89.3),
        (1.053, 1.5639, 148.7),
        (1.5555, 0.702, 81.8),
        (0.702, 1.3595, -21.9),
        (1.6111, 0.702, 76.7),
    ),
)

MAPS = {SMALL_LOOP.name: SMALL_LOOP}
