"""The contact laws by the names that a study gives them."""

from yade_scripts.contacts import cohesive_frictional_local_damping, hertz_mindlin
from yade_scripts.layered import cohesive_frictional

HERTZ_MINDLIN = "hertz_mindlin"
COHESIVE_FRICTIONAL = "cohesive_frictional"  # dissipates at the contact
LOCAL_DAMPING = "cohesive_frictional_local_damping"  # that of release 0.1, to repeat its results
LAWS = {
    COHESIVE_FRICTIONAL: cohesive_frictional,
    HERTZ_MINDLIN: hertz_mindlin,
    LOCAL_DAMPING: cohesive_frictional_local_damping,
}
