"""Steps of YADE in which every new contact is told what its functors could not tell it."""

from collections.abc import Callable


def single(born: Callable | None) -> Callable[[], None]:
    """One step of YADE, after which `born` is called once with each contact that came into being in it.

    What it sets is in force from the next step on. Without `born` this is YADE's own step.
    """
    from yade import O

    if born is None:
        return O.step
    omega, contacts, step = O, O.interactions, O.step

    def watched() -> None:
        step()
        now = omega.iter - 1
        for contact in [contact for contact in contacts if contact.iterMadeReal == now]:
            born(contact)

    return watched


def run(steps: int, born: Callable | None) -> None:
    """So many steps; without `born` all inside YADE."""
    from yade import O

    if born is None:
        O.run(steps, True)
        return
    step = single(born)
    for _ in range(steps):
        step()
