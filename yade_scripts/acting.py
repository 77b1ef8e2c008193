"""Effects in a scene. In that of the bench rigs: what each place of the scene asks of the effects that are present.

| place | asked with | answers |
|---|---|---|
| `slope_deg` | angle by the scale, deg | true angle of plate or slope, deg |
| `aspect` | 1 | length over width of the clump, as a share of the measured one |
| `contact` | contacts.Pair | contacts.Pair |
| `restitution` | e; normal approach speed of a new contact, m/s | e |
| `friction` | mu; the seed's normal load, N | mu |
| `rolling` | 0; rolling speed, m/s | rolling friction coefficient beyond the constant one |
| `tangential_stiffness` | 1 | share of the contact law's tangential stiffness |
| `force` | force on the centre of mass, N; velocity, m/s; volume, m3 | force, N |
| `reading` | the rig's first observable | the reading, in its unit |

An effect's function gets what the place asks with and its own parameters last. Effects that share a place act one
after the other.
"""


def declared(modules, rig: str = "") -> dict:
    """{effect: {parameter: declaration}} of a rig's effect files, for its RIG."""
    return {module.EFFECT["name"]: parameters(module, rig) for module in modules}


def parameters(module, rig: str = "") -> dict:
    """An effect's parameters in a rig: its own there, where the amount is another quantity."""
    return module.EFFECT.get("parameters_in", {}).get(rig, module.EFFECT["parameters"])


class Effects:
    """The effects present in a case: those whose amount, their first parameter, is not the value that means absent.

    Parameters
    ----------
    modules : the rig's effect files
    case : a complete case
    scene : what the effects call their places there
    rig : where the amount of an effect may be another quantity
    """

    def __init__(self, modules, case: dict, scene: str = "SEED_SCENE", rig: str = ""):
        self._at: dict[str, list] = {}
        for module in modules:
            values = case["effects"][module.EFFECT["name"]]
            amount, quantity = next(iter(parameters(module, rig).items()))
            if values[amount] != quantity["absent"]:
                for place, act in getattr(module, scene, {}).items():
                    self._at.setdefault(place, []).append((act, values))

    def __contains__(self, place: str) -> bool:
        return place in self._at

    def at(self, place: str, value, *given):
        """What the effects make of a value at a place; the value itself where none acts."""
        for act, values in self._at.get(place, ()):
            value = act(value, *given, values)
        return value
