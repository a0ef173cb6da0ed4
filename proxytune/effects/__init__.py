"""Effects: causal filters that bend commands, motion or pictures, each with a value at which it vanishes.

effect       what an effect is, what it says of the trace it leaves, and what filters share: low-pass, dead reckoning
compiled     filters of long signals by Numba
command      single messages between agent and motors: delayed, jittered, dropped, quantised
motors       from a command to a wheel's speed: lag, slew rate, limits, gains, battery, heat
friction     dead band, stiction, backlash, wheels that are out of round
cars         what only a car has, and effects of wheels on its throttle or its steering
motion       from wheels to the body: scrub, slip, coupling, slopes, patches; and where its pose is measured
camera       how a camera is mounted and what its lens draws
image        how a picture comes out: blur, rolling shutter, latency, focus, light, noise
features     signals over which unnamed motion is fitted
learnt       unnamed motion as curves over them, in θ and in model.toml
catalogue    every effect by name, a user's own among them, and effects from values of θ
model        a domain instance as model.toml, and the effects of a stage as one chain
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
