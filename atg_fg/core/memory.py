"""The robot memory ℳ: the ATGs of all objects judged novel so far (section 3 of the paper)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.checks import brief, plain_text, sequence
from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.core.merging import Merge, check_merges
from atg_fg.core.object_sense import Moments
from atg_fg.core.open_alphabets import Relabelling
from atg_fg.core.patterns import Confidences, Detection, Evidence, Measured, SlotLikelihoods
from atg_fg.core.sense import Readings, Sense, SensedTrial
from atg_fg.core.table import Bar, Cell, Table
from atg_fg.core.transactions import Persistent, one_transaction


class RobotMemory(Persistent):
    """ATGs by name, in the order they were made, under one set of assumptions.

    Args:
        assumptions: |O|, |G|, actions and alphabet.
        graphs: ATGs under the same assumptions, with unique names.
        merges: Those that led to these graphs, in their order.
        sense: What reads the observations that these graphs were made from; ``None`` if they are symbols themselves.

    Raises:
        InvalidInputError: A repeated name, a graph made under other assumptions, or merges that lead to others.

    Attributes:
        sense: As given; it learns with the memory.
    """

    def __init__(
        self,
        assumptions: Assumptions,
        graphs: Iterable[AspectTransitionGraph] = (),
        merges: Iterable[Merge] = (),
        sense: Sense | None = None,
    ) -> None:
        if not isinstance(assumptions, Assumptions):
            raise InvalidInputError(f"memory: {brief(assumptions)}; expected Assumptions")
        self.assumptions = assumptions
        self.sense = sense
        self._graphs: dict[str, AspectTransitionGraph] = {}
        self._merges: list[Merge] = []
        for graph in graphs:
            self.add(graph)
        self._merges = list(merges)
        check_merges(self._merges, self._graphs, "merges")

    @one_transaction
    def add(self, graph: AspectTransitionGraph) -> None:
        """Add the ATG of a novel object.

        Raises:
            InvalidInputError: The name is taken, or the assumptions differ.
        """
        if graph.name in self._graphs or graph.name in self._dropped:
            raise InvalidInputError(f"memory: name {graph.name!r} is repeated; expected unique names")
        if graph.assumptions != self.assumptions:
            raise InvalidInputError(f"memory: {graph.name!r} was made under other assumptions than this memory")
        self._graphs[graph.name] = graph

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the remembered objects; object index i is the i-th of them."""
        return tuple(self._graphs)

    @property
    def n_unseen(self) -> int:
        """U = max(|O| − K, 1), the number of objects never met."""
        return max(self.assumptions.n_objects - len(self), 1)

    @one_transaction
    def learn(
        self,
        patterns: Sequence[int | None],
        actions: Sequence[int | None],
        matched: str | None,
        name: str | None = None,
        measured: Sequence[Measured] = (),
    ) -> str:
        """Learn from a trial and return the name of the ATG it went to.

        Args:
            patterns: Index of the pattern seen at each time, ``None`` where it was not complete, length t + 1.
            actions: Index of the action between each two, ``None`` where it is not sure, length t.
            matched: Name of the ATG to extend, or ``None`` if the object was judged novel.
            name: Of the ATG of a novel object; the next number if not given.
            measured: What was felt of the object as a whole at each look; none if nothing was.

        Raises:
            UnknownNameError: There is no such ATG.
            InvalidInputError: Lengths or indices that do not fit, a novel object of which no pattern was seen whole, a
                name that is taken, or what is no reading.
        """
        patterns, actions = sequence(patterns, "learn: patterns"), sequence(actions, "learn: actions")
        if matched is None and all(pattern is None for pattern in patterns):
            raise InvalidInputError("learn: no pattern was seen whole; expected at least one of a novel object")
        if matched is None:
            graph = AspectTransitionGraph(self._free_name(name), self.assumptions)
        else:
            graph = self[matched].copy()
        graph.learn(patterns, actions)
        for each in measured:
            graph.measure(each)
        self._graphs[graph.name] = graph
        return graph.name

    def learn_shared(
        self,
        name: str,
        detections: Sequence[Detection],
        actions: Sequence[int],
        confidences: Sequence[Confidences] = (),
        likelihoods: Sequence[SlotLikelihoods] = (),
        measured: Sequence[Measured] = (),
        *,
        taught: bool = False,
    ) -> str:
        """Learn from a raw trial what all objects share: nothing, in a memory that takes each object by itself.

        Returns the name of the ATG that the trial is of from now on.

        Args:
            name: Name of the ATG that the trial went to.
            detections: The symbol in each slot at each look, ``None`` where nothing was seen, length t + 1.
            actions: Index of the action between each two, length t.
            confidences: How sure the detector was of each symbol at each look; none if it never says.
            likelihoods: Of the symbols in each slot at each look, where evidence was no symbol; none if it always was.
            measured: What was felt of the object as a whole at each look; none if nothing was.
            taught: Whether someone said of which object the trial is, so that nothing changes hands because of it.
        """
        return name

    @one_transaction
    def learn_readings(
        self, name: str, readings: Sequence[Readings], detections: Sequence[Detection], actions: Sequence[int]
    ) -> None:
        """Let the sense learn from what was measured in a trial.

        Where all readings were looked at again, and some are taken for the look of another class now, the ATGs that
        were made from such trials alone are estimated again.

        Args:
            name: Name of the ATG that the trial went to.
            readings: Of each look, length t + 1.
            detections: What they were taken for.
            actions: Index of the action between each two, length t.

        Raises:
            InvalidInputError: This memory has no sense, or one of other readings.
        """
        if self.sense is None:
            raise InvalidInputError("learn: readings for a memory without a sense; expected one that has it")
        sense = self.sense.copy()  # nothing is half learned if there is an error
        before = [*self.sense.trials, SensedTrial(self[name].name, tuple(readings), tuple(detections), tuple(actions))]
        changed = sense.learn(before[-1])
        self.sense = sense
        if changed is not None:
            self._take_for(before, changed)

    def _take_for(self, before: Sequence[SensedTrial], detections: Sequence[tuple[Detection, ...]]) -> None:
        """Take the looks of all trials for what they show now; ``before`` says what they were taken for."""
        owners = self._owners_of(before)
        for name in dict.fromkeys(owners):
            own = [number for number, owner in enumerate(owners) if owner == name]
            trials = [(before[number].detections, detections[number], before[number].actions) for number in own]
            if name not in self._graphs or not any(old != new for old, new, _ in trials):
                continue
            readings = self._graphs[name].measured
            made = [(self._patterns(old), actions) for old, _, actions in trials]
            if self._graphs[name] == self._made_of(name, made, readings):
                anew = [(self._patterns(new), actions) for _, new, actions in trials]
                self._graphs[name] = self._made_of(name, anew, readings)

    def _owners_of(self, trials: Sequence[SensedTrial]) -> list[str]:
        """Return the name of the ATG that each trial is of."""
        return [trial.owner for trial in trials]

    def _made_of(
        self, name: str, trials: Iterable[tuple[Sequence[int | None], Sequence[int]]], readings: Mapping[str, Moments]
    ) -> AspectTransitionGraph:
        """Return the ATG that patterns and actions of some trials make, and what is kept of readings."""
        graph = AspectTransitionGraph(name, self.assumptions)
        for sense, moments in readings.items():
            graph.add_moments(sense, moments)
        for patterns, actions in trials:
            graph.learn(patterns, actions)
        return graph

    def _patterns(self, detections: Iterable[Detection]) -> list[int | None]:
        return [Evidence.of_detection(self.assumptions.alphabet, each).pattern for each in detections]

    @one_transaction
    def rename(self, old: str, new: str) -> None:
        """Give an ATG another name; all that was learned stays with it.

        Raises:
            UnknownNameError: There is no ATG of the old name.
            InvalidInputError: The new name is taken or is none, or the ATG has taken part in a merge.
        """
        graph, new = self[old], self._free_name(plain_text(new, "name"))
        if any(old in (merge.kept.name, merge.dropped.name) for merge in self._merges):
            raise InvalidInputError(f"rename: {old!r} has taken part in a merge; expected that to be undone first")
        renamed = AspectTransitionGraph(new, self.assumptions)
        renamed.absorb(graph)
        self._graphs = {each.name: each for each in (renamed if name == old else g for name, g in self._graphs.items())}
        self._rename_shared(old, new)

    def _rename_shared(self, old: str, new: str) -> None:
        """Give an object another name in what all objects share."""

    def _free_name(self, name: str | None) -> str:
        """Return a name for a new ATG: the one that is wanted, if it is free."""
        if name is None:
            return self._new_name()
        if plain_text(name, "name") in self._graphs or name in self._dropped:
            raise InvalidInputError(f"memory: name {brief(name)} is taken; expected one that no ATG has or had")
        return name

    def _new_name(self) -> str:
        number = len(self)
        while f"object-{number:03d}" in self._graphs or f"object-{number:03d}" in self._dropped:
            number += 1
        return f"object-{number:03d}"

    @property
    def merges(self) -> tuple[Merge, ...]:
        """What was merged and not undone, in its order."""
        return tuple(self._merges)

    @property
    def _dropped(self) -> list[str]:
        """Names of ATGs that were merged into others; they are kept free for undoing it."""
        return [merge.dropped.name for merge in self._merges]

    @one_transaction
    def merge(self, keep: str, drop: str) -> Merge:
        """Make one ATG of two that were made from one object; return the record that ``unmerge`` goes by.

        Args:
            keep: Name of an ATG, which the merged one has.
            drop: Name of another one, which ceases to exist.

        Raises:
            UnknownNameError: There is no such ATG.
            InvalidInputError: Both are the same.
        """
        if keep == drop:
            raise InvalidInputError(f"merge: {keep!r} with itself; expected two ATGs")
        kept, dropped = self[keep].copy(), self[drop].copy()
        merge = Merge(kept, dropped, self.names.index(drop), self._merge_shared(keep, drop))
        self._graphs[keep] = merge.merged()
        del self._graphs[drop]
        self._merges.append(merge)
        return merge

    @one_transaction
    def unmerge(self, name: str) -> None:
        """Undo a merge: both ATGs are as they were; what was learned since stays with the one that was kept.

        If merges are undone in reverse order and nothing was learned since, the memory is exactly as it was before.

        Args:
            name: Of the ATG that was dropped.

        Raises:
            UnknownNameError: No ATG of this name was merged into another.
            InvalidInputError: The ATG that it was merged into has taken part in a later merge, to be undone first.
        """
        if name not in self._dropped:
            raise unknown_name("unmerge", name, self._dropped)
        number = self._dropped.index(name)
        merge = self._merges[number]
        for later in self._merges[number + 1 :]:
            if merge.kept.name in (later.kept.name, later.dropped.name):
                raise InvalidInputError(
                    f"unmerge: {name!r}; expected {later.dropped.name!r}, which was merged later, to be undone first"
                )
        graphs = list(self._graphs.items())
        graphs.insert(merge.position, (name, merge.dropped.copy()))
        self._graphs = dict(graphs)
        self._graphs[merge.kept.name] = merge.undone(self[merge.kept.name])
        del self._merges[number]
        self._unmerge_shared(merge)

    def _merge_shared(self, keep: str, drop: str) -> tuple[int, ...]:
        """Merge two objects in what all objects share; return the numbers of the raw trials that were of ``drop``."""
        return ()

    def _unmerge_shared(self, merge: Merge) -> None:
        """Undo a merge in what all objects share, too."""

    def extended(self, labels: Iterable[str]) -> RobotMemory:
        """Return a memory of the same whose open alphabet has these labels, too; itself if it has them all.

        Raises:
            InvalidInputError: The alphabet is closed, and lacks one.
        """
        before = self.assumptions.alphabet
        alphabet = before.extended(labels)
        if alphabet is before:
            return self
        return self._under(replace(self.assumptions, alphabet=alphabet), Relabelling(before, alphabet))

    @one_transaction
    def extend(self, labels: Iterable[str]) -> None:
        """Add those of some labels that the open alphabet lacks; all that was learned stays.

        Raises:
            InvalidInputError: The alphabet is closed, and lacks one.
        """
        extended = self.extended(labels)
        if extended is not self:
            self.become(extended)

    def _under(self, assumptions: Assumptions, labels: Relabelling) -> RobotMemory:
        """Return a memory of the same under assumptions with another alphabet."""
        graphs = (graph.relabelled(assumptions, labels) for graph in self)
        merges = [merge.relabelled(assumptions, labels) for merge in self._merges]
        return RobotMemory(assumptions, graphs, merges, self._sense_copied())

    def become(self, other: RobotMemory) -> None:
        """Replace the assumptions, ATGs and merges by those of another memory."""
        self.assumptions = other.assumptions
        self._graphs, self._merges, self.sense = dict(other._graphs), list(other._merges), other.sense

    def copy(self) -> RobotMemory:
        """Return a memory that can learn without touching this one."""
        return RobotMemory(self.assumptions, (graph.copy() for graph in self), self._merges, self._sense_copied())

    def __copy__(self) -> RobotMemory:
        return self.copy()

    def _sense_copied(self) -> Sense | None:
        return None if self.sense is None else self.sense.copy()

    def __getitem__(self, name: str) -> AspectTransitionGraph:
        try:
            return self._graphs[name]
        except (KeyError, TypeError):  # what cannot be hashed is no name
            raise unknown_name("memory", name, self._graphs) from None

    def __len__(self) -> int:
        """K, the number of remembered objects."""
        return len(self._graphs)

    def __iter__(self) -> Iterator[AspectTransitionGraph]:
        return iter(self._graphs.values())

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, RobotMemory):
            return NotImplemented
        ours, theirs = ((each.assumptions, list(each), each.merges, each.sense) for each in (self, other))
        return ours == theirs

    def table(self) -> Table:
        """Return the remembered objects, the first ones of many."""
        assumptions = self.assumptions
        rows: list[tuple[Cell, ...]] = []
        # The last ones are not looked at: a memory may hold very many.
        for _, graph in zip(range(_OBJECTS), self, strict=False):
            aspects = Bar(graph.n_known / assumptions.n_aspects, f"{graph.n_known} of {assumptions.n_aspects}")
            rows.append((graph.name, aspects, str(len(graph.counts)), str(sum(graph.counts.values()))))
        if len(self) > len(rows):
            rows.append((f"… and {len(self) - len(rows)} other objects", "", "", ""))
        title = f"Robot memory: {len(self)} of {assumptions.n_objects} objects"
        headings = ("object", "known aspects", "edges", "seen, times") if rows else ()
        merged = f"; {len(self.merges)} merged into others" if self.merges else ""
        slots = f"{', '.join(assumptions.alphabet.slots)} of {assumptions.alphabet.n_symbols} symbols"
        note = f"actions {', '.join(assumptions.actions)}; slots {slots}{merged}{self._more_to_say()}"
        return Table(title, headings, tuple(rows), note)

    def _more_to_say(self) -> str:
        """Return what else stands below the table."""
        return ""

    def _repr_html_(self) -> str:
        return self.table()._repr_html_()

    def __repr__(self) -> str:
        return f"{type(self).__name__}({len(self)} of {self.assumptions.n_objects} objects)"


_OBJECTS: Final = 12
