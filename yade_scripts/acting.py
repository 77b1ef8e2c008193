"""Effects in the scene of the bench rigs: what each place of the scene asks of the effects that are present.

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


def declared(modules) -> dict:
    """{effect: {parameter: declaration}} of a rig's effect files, for its RIG."""
    return {module.EFFECT["name"]: module.EFFECT["parameters"] for module in modules}


class Effects:
    """The effects present in a case: those whose amount, their first parameter, is not the value that means absent.

    Parameters
    ----------
    modules : the rig's effect files
    case : a complete case
    """

    def __init__(self, modules, case: dict):
        self._at: dict[str, list] = {}
        for module in modules:
            values = case["effects"][module.EFFECT["name"]]
            amount, quantity = next(iter(module.EFFECT["parameters"].items()))
            if values[amount] != quantity["absent"]:
                for place, act in module.SEED_SCENE.items():
                    self._at.setdefault(place, []).append((act, values))

    def __contains__(self, place: str) -> bool:
        return place in self._at

    def at(self, place: str, value, *given):
        """What the effects make of a value at a place; the value itself where none acts."""
        for act, values in self._at.get(place, ()):
            value = act(value, *given, values)
        return value
