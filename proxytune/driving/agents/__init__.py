"""Agents: controllers that see only the camera's picture and know only the nominal camera."""

from collections.abc import Mapping
from types import MappingProxyType

from proxytune.driving.agents.agent import Agent, Command, Picture
from proxytune.driving.agents.pilots import LanePilot, PursuitPilot
from proxytune.driving.agents.reflexes import Braitenberg, EdgePilot
from proxytune.driving.agents.wrappers import Laggy, Leaning, Smoothed, Wary

AGENTS: Mapping[str, Agent] = MappingProxyType(
    {
        "crawler": LanePilot(speed=0.10, offset_gain=8.0, slope_gain=1.5),
        "stroller": LanePilot(speed=0.16, offset_gain=8.0, slope_gain=2.0),
        "steady": LanePilot(speed=0.20, offset_gain=8.0, slope_gain=2.0),
        "brisk": LanePilot(speed=0.30, offset_gain=10.0, slope_gain=3.0),
        "daredevil": LanePilot(speed=0.45, offset_gain=8.0, slope_gain=2.0),
        "pursuer_near": PursuitPilot(speed=0.22, look_ahead_m=0.25),
        "pursuer_far": PursuitPilot(speed=0.35, look_ahead_m=0.35, caution=0.6),
        "yellow_only": LanePilot(speed=0.25, offset_gain=8.0, slope_gain=2.0, markings="yellow", contrast=90.0),
        "white_only": LanePilot(speed=0.27, offset_gain=8.0, slope_gain=2.0, markings="white"),
        "smooth": Smoothed(LanePilot(speed=0.25, offset_gain=8.0, slope_gain=2.0), share=0.15),
        "laggy": Laggy(LanePilot(speed=0.22, offset_gain=8.0, slope_gain=2.0), steps=5),
        "drifter": Leaning(LanePilot(speed=0.18, offset_gain=2.5, slope_gain=0.6), bias=0.15),
        "wary": Wary(LanePilot(speed=0.50, offset_gain=14.0, slope_gain=4.5), contrast=120.0, crisp=14.0, slowest=0.15),
        "wary_pursuer": Wary(PursuitPilot(speed=0.60, look_ahead_m=0.25), contrast=118.0, crisp=20.0, slowest=0.15),
        "sharp_eyed": LanePilot(speed=0.22, offset_gain=8.0, slope_gain=2.0, markings="yellow", contrast=112.0),
        "braitenberg": Braitenberg(speed=0.20, push=14.0),
        "edges": EdgePilot(speed=0.15, gain=4.0),
    }
)
"""The agents that travel with the package, by name."""

__all__ = ["AGENTS", "Agent", "Braitenberg", "Command", "EdgePilot", "Laggy", "LanePilot", "Leaning", "Picture"]
__all__ += ["PursuitPilot", "Smoothed", "Wary"]
