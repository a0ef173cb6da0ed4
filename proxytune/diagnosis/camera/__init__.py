"""The diagnosis of a camera, in the order in which frames go through it.

edges           points on the edges of markings, to a fraction of a pixel; poses at the frames' instants
model           edge points projected to the floor, their distance r from the map's markings [pixel]; pictures drawn
fitting         θ by Gauss–Newton on a redescending loss of r, with tape, map and every pose eliminated (Schur)
selection       the fewest effects that do as well as all; the residual field test; frames that do not match
light           exposure and vignetting, and what hides the floor
appearance      with blur, defocus and noise: how pictures look besides where things are in them
error           errors before and after on frames that were not fitted, and the size of every effect
diagnose        the whole, and its verdict
"""
