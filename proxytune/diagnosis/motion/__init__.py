"""The diagnosis of motion, in the order in which a log goes through it.

drives          commands on a grid of ticks (zero-order hold), increments between measured poses
latency         time from command to motion, any motor lag allowed
clocks          whether both share a clock; drives put right, cut, and kept aside to test on
innovations     increments of a model by replay, whitened by a Kalman filter in SE(2):  z = L⁻¹(measured − predicted)
compiled        the likelihood of noise and dead reckoning by Numba
fitting         θ and noise by least squares on Huber's loss of z; held-out likelihood block by block
screening       score test of every candidate effect:  gain = −(gᵀm + ½ mᵀHm),  m = −H⁺g
random_effects  likelihood of effects that strike at random, and their size by indirect inference
signals         curves over every signal: the most that a nameless effect could explain
evidence        all of these for one model, and what a search comes to
selection       forward selection of effects, backward elimination
prediction      windows of open-loop prediction, ratios of their errors with intervals, repeated drives
multistep_fit   θ refitted to windows; the noise floor of their errors; the bullet plant
effect_size     error without an effect by the error with it; what could not be seen; two robots in one log
discrepancy     what no name explains, learnt as curves and guarded
curve_selection the groups of curves that pay on parts left out
manoeuvres      a library of drives
excitation      the drive to do next, designed:  T_ab = ½ min ‖z_a − z_b‖², or ½ log|I + DᵀD|
diagnose        the whole, and its verdict
"""
