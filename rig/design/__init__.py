"""What a gate layout and a plan will tell, before anything falls, and better beam heights.

The equations are those of `rig.analysis`, made at the edges that the model predicts: what they say
of every unknown depends on where the beams are, and not on what they will see.
"""
