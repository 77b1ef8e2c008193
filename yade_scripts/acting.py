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
| `reading` | an observable that the effect reads | the reading, in its unit |

An effect's function gets what the place asks with and its own parameters last. Effects that share a place act one
after the other. `reading` acts when a rig has observed all, on its first observable, or on those that the EFFECT names
as `reads` (`read_of`).
"""

READING = "reading"
SCENES = ("SEED_SCENE", "POWDER_SCENE")


def declared(modules, rig: str = "") -> dict:
    """{effect: {parameter: declaration}} of a rig's effect files, for its RIG."""
    return {module.EFFECT["name"]: parameters(module, rig) for module in modules}


def parameters(module, rig: str = "") -> dict:
    """An effect's parameters in a rig: its own there, where the amount is another quantity."""
    return module.EFFECT.get("parameters_in", {}).get(rig, module.EFFECT["parameters"])


def present(module, case: dict, rig: str = "") -> bool:
    """Whether an effect is there in a case: its amount, the first parameter, is not the value that means absent."""
    amount, quantity = next(iter(parameters(module, rig).items()))
    return case["effects"][module.EFFECT["name"]][amount] != quantity["absent"]


def reads(effect: dict, observable: str, observables) -> bool:
    """Whether an effect on readings acts on one of a rig's observables, given in its order.

    Simulations and the surfaces that stand for them both go by it.
    """
    return observable in effect.get("reads", tuple(observables)[:1])


def read_of(modules, case: dict, observed: dict, rig: str = "") -> dict:
    """What is read of a rig's {observable: value}, in its order; one that does not apply is None and stays so."""
    found = dict(observed)
    for module in modules:
        act = next((getattr(module, s)[READING] for s in SCENES if READING in getattr(module, s, {})), None)
        if act is not None and present(module, case, rig):
            values = case["effects"][module.EFFECT["name"]]
            for name, value in found.items():
                if value is not None and reads(module.EFFECT, name, observed):
                    found[name] = act(value, values)
    return found


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
            if present(module, case, rig):
                values = case["effects"][module.EFFECT["name"]]
                for place, act in getattr(module, scene, {}).items():
                    if place != READING:
                        self._at.setdefault(place, []).append((act, values))

    def __contains__(self, place: str) -> bool:
        return place in self._at

    def at(self, place: str, value, *given):
        """What the effects make of a value at a place; the value itself where none acts."""
        for act, values in self._at.get(place, ()):
            value = act(value, *given, values)
        return value
