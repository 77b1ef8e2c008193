"""The contact laws by the names that a study gives them."""

from yade_scripts.contacts import cohesive_frictional_local_damping, hertz_mindlin
from yade_scripts.layered import cohesive_frictional_restitution

RESTITUTION = "cohesive_frictional_restitution"  # dissipates at the contact
LOCAL_DAMPING = ("cohesive_frictional", "cohesive_frictional_local_damping")  # two names of one law of release 0.1
LAWS = {
    "hertz_mindlin": hertz_mindlin,
    **dict.fromkeys(LOCAL_DAMPING, cohesive_frictional_local_damping),
    RESTITUTION: cohesive_frictional_restitution,
}
