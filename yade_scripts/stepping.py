"""Steps of YADE in which every new contact is told what its functors could not tell it."""

from collections.abc import Callable


def single(contacts) -> Callable[[], None]:
    """One step of YADE; `contacts.born` is called once with each contact soon after it has come into being.

    That is after the contact's first step, or where `contacts.looks_every` says so some steps later; what it sets is in
    force from the next step on. Without `born` this is YADE's own step.

    Parameters
    ----------
    contacts : contacts.Contacts, of the scene as it is now
    """
    from yade import O

    if contacts.born is None:
        return O.step
    omega, interactions, step = O, O.interactions, O.step
    born, tended, every = contacts.born, contacts.tended, contacts.looks_every
    since = omega.iter

    def watched() -> None:
        nonlocal since
        step()
        now = omega.iter
        if now - since >= every:
            for contact in [contact for contact in interactions if contact.iterMadeReal >= since]:
                born(contact)
            if tended:
                tended()
            since = now

    return watched
