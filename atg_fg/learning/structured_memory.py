"""A robot memory that also learns what all its objects share."""

from __future__ import annotations

import copy
import itertools
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.looks import evidence_in, likely_pattern
from atg_fg.core.memory import RobotMemory
from atg_fg.core.merging import Merge
from atg_fg.core.open_alphabets import Relabelling
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Confidences, Detection, Evidence, Measured, SlotLikelihoods
from atg_fg.core.sense import Sense, SensedTrial
from atg_fg.core.transactions import one_transaction
from atg_fg.learning.evidence_learner import EvidenceLearner, SavedEvidence
from atg_fg.learning.learner import StructureLearner
from atg_fg.learning.milestones import is_milestone, next_milestone
from atg_fg.learning.raw_trials import RawTrial, Reassignment

#: Nats of evidence, and least number of trials, by which one model of looks outdoes the other so that it rests.
OUTDONE: Final = 20.0
FIRST_TRIALS: Final = 8
#: Trials that are always learned from one by one: what is learned from the first ones goes through many hands.
FIRST_ALONE: Final = 48
#: Gain of a model whose structure is mistaken.
MISTAKEN: Final = -2 * OUTDONE


class StructuredMemory(RobotMemory):
    """ATGs by name, and beside them the raw trials they were made from and the structure learned from all of these.

    Args:
        assumptions: |O|, |G|, actions and alphabet.
        graphs: ATGs under the same assumptions, with unique names.
        learner: Its trials are of these ATGs; one that knows nothing yet if not given.
        merges: Those that led to these graphs, in their order.
        sense: As for ``RobotMemory``.

    Raises:
        InvalidInputError: A repeated name, a graph made under other assumptions, merges that lead to others, or that
            name trials which are not there.

    Attributes:
        evidence: What is sampled from the same trials where looks err.
    """

    def __init__(
        self,
        assumptions: Assumptions,
        graphs: Iterable[AspectTransitionGraph] = (),
        learner: StructureLearner | None = None,
        merges: Iterable[Merge] = (),
        sense: Sense | None = None,
    ) -> None:
        super().__init__(assumptions, graphs, merges, sense)
        self.learner = learner or StructureLearner(assumptions)
        self._reassignments: list[Reassignment] = []
        n_trials = len(self.learner.trials)
        for number, merge in enumerate(self.merges):
            for trial in merge.trials:
                if not 0 <= trial < n_trials:
                    raise InvalidInputError(f"merges[{number}].trials: {trial}; expected less than {n_trials}")

    @property
    def learner(self) -> StructureLearner:
        """The raw trials, and the structures learned from them where looks are nearly always right."""
        return self._learner

    @learner.setter
    def learner(self, learner: StructureLearner) -> None:
        self._learner = learner
        self.evidence = EvidenceLearner(learner)
        self._gain: float | None = None

    @one_transaction
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
        """Keep a raw trial, and learn from it what all objects share; return the name of the ATG that it is of now.

        Where looks err, raw trials of the past may turn out to be of other objects than they were taken for. Their
        ATGs are then estimated again; what happened is in ``reassignments``. Arguments are those of
        ``RobotMemory.learn_shared``; from likelihoods the model in which looks err learns as a whole.

        Raises:
            UnknownNameError: There is no such ATG.
            InvalidInputError: It is no trial under these assumptions.
        """
        felt = tuple(measured) if any(measured) else ()
        trial = RawTrial(tuple(detections), tuple(actions), tuple(confidences), tuple(likelihoods), felt)
        trial.check(self.assumptions)
        before = self.gain if len(self.learner.trials) >= FIRST_TRIALS else 0.0
        # A model that is far behind rests: it looks at all trials again whenever their number has doubled, but that of
        # sure looks merges trials at each milestone. One that is mistaken goes on: once it knows more, it may take for
        # wrong looks what were errors of single labels before.
        n_trials = len(self.learner.trials) + 1
        has_doubled = n_trials.bit_count() == 1
        rests = before > OUTDONE and not has_doubled
        self.learner.learn(self[name].name, trial, rests=rests)
        if before > -OUTDONE or before == MISTAKEN or has_doubled:
            self.evidence.learn()
            self._weigh(anew=not rests or is_milestone(n_trials))
            if self.erring and not taught:
                self._mend()
        return self.learner.owners[-1]

    @property
    def n_together(self) -> int:
        """How many trials may be learned from at once: those up to the next milestone, none while models are rivals."""
        n_trials = len(self.learner.trials)
        if n_trials < FIRST_ALONE or self.gain < OUTDONE or self.sense is not None:
            return 0
        return next_milestone(n_trials) - n_trials

    @one_transaction
    def learn_together(self, trials: Sequence[RawTrial]) -> list[str]:
        """Learn from raw trials at once, without a verdict on each; return the names of the ATGs that they are of.

        All raw trials are sampled again once for all of these, where ``learn_shared`` does so for each.

        Args:
            trials: In each of them a pattern was seen whole; ``n_together`` of them at most.

        Raises:
            InvalidInputError: A trial is none under these assumptions, or there are too many.
        """
        if len(trials) > self.n_together:
            raise InvalidInputError(f"trials: {len(trials)}; expected at most {self.n_together} to learn from together")
        for number, trial in enumerate(trials):
            trial.check(self.assumptions, f"trial {number}")
        objects = self.evidence.objects_with(trials)
        names = self._names_of(objects)
        for trial, number in zip(trials, objects[len(self.learner.trials) :], strict=True):
            name, alphabet = names[number], self.assumptions.alphabet
            patterns = [Evidence.of_detection(alphabet, each).pattern for each in trial.detections]
            self.learn(patterns, trial.actions, name if name in self.names else None, name, trial.measured)
            self.learner.learn(name, trial, rests=True)
        self.evidence.learn()
        n_trials = len(self.learner.trials)
        self._weigh(anew=n_trials.bit_length() > (n_trials - len(trials)).bit_length())
        self._mend()
        return self.learner.owners[-len(trials) :]

    @property
    def erring(self) -> bool:
        """Whether looks err so much that the model in which they do explains the raw trials better."""
        return self.log_erring_weights[0] > self.log_erring_weights[1]

    def restore_evidence(
        self, saved: SavedEvidence | None, gain: float | None, reassignments: Iterable[Reassignment]
    ) -> None:
        """Go on from what was kept: what was sampled, by how much it is ahead, and what changed hands."""
        if saved is not None:
            self.evidence.restore(saved)
        self._gain, self._reassignments = gain, list(reassignments)

    @property
    def reassignments(self) -> tuple[Reassignment, ...]:
        """Raw trials that were given to other ATGs than they had been, in their order."""
        return tuple(self._reassignments)

    @one_transaction
    def reassign(self, trials: Mapping[int, str]) -> None:
        """Give raw trials to other ATGs, which are estimated again from theirs; giving them back undoes it.

        An ATG that has no trial left is no more; a name that is not there is that of a new one. What an ATG knows from
        elsewhere than raw trials it keeps, and ATGs that were merged stay as they are.

        Args:
            trials: Name of the new ATG of each trial, by its number.

        Raises:
            InvalidInputError: There is no such trial.
        """
        owners = self.learner.owners
        for number in trials:
            if not 0 <= number < len(owners):
                raise InvalidInputError(f"reassign: trial {number}; expected less than {len(owners)}")
        merged = {graph.name for merge in self.merges for graph in (merge.kept, merge.dropped)}
        moved = {
            number: name
            for number, name in trials.items()
            if owners[number] != name and not {owners[number], name} & merged
        }
        touched = dict.fromkeys([*(owners[number] for number in moved), *moved.values()])
        own = [name for name in touched if name not in self._graphs or self._graphs[name] == self._estimated(name)]
        for number, name in moved.items():
            self._reassignments.append(Reassignment(len(owners), number, owners[number], name))
        self.learner.hand_over(moved)
        self.evidence.forget_verdict()
        for name in own:
            if name in owners:
                self._graphs[name] = self._estimated(name)
            else:
                del self._graphs[name]

    def _estimated(self, name: str) -> AspectTransitionGraph:
        """Return the ATG that the raw trials of a name make."""
        trials = [trial for trial, owner in zip(self.learner.trials, self.learner.owners, strict=True) if owner == name]
        felt = AspectTransitionGraph(name, self.assumptions)
        for measured in itertools.chain.from_iterable(trial.measured for trial in trials):
            felt.measure(measured)
        return self._made_of(name, ((self._patterns_of(trial), trial.actions) for trial in trials), felt.measured)

    def _patterns_of(self, trial: RawTrial) -> list[int | None]:
        """Return the patterns of a trial to learn from."""
        if self.sense is not None or not trial.likelihoods:
            return self._patterns(trial.detections)
        looks = zip(trial.detections, trial.likelihoods, strict=True)
        alphabet = self.assumptions.alphabet
        return [likely_pattern(evidence_in(alphabet, seen, {"likelihoods": slots})) for seen, slots in looks]

    def _owners_of(self, trials: Sequence[SensedTrial]) -> list[str]:
        """Return the name of the ATG that each trial is of: raw trials may have changed hands."""
        return [*super()._owners_of(trials)[: -len(self.learner.owners)], *self.learner.owners]

    def _take_for(self, before: Sequence[SensedTrial], detections: Sequence[tuple[Detection, ...]]) -> None:
        super()._take_for(before, detections)
        # Raw trials are the last ones: those of before the memory had a structure to learn are the sense's alone.
        raw = [
            replace(trial, detections=taken, likelihoods=())
            for taken, trial in zip(detections[-len(self.learner.trials) :], self.learner.trials, strict=True)
        ]
        self.learner.take_for(raw)
        self.evidence.forget_verdict()

    def _mend(self) -> None:
        """Give raw trials to the ATGs that what was sampled says."""
        objects = self.evidence.objects()
        names = self._names_of(objects)
        self.reassign({trial: names[number] for trial, number in enumerate(objects)})

    def _names_of(self, objects: Sequence[int]) -> dict[int, str]:
        """Return a name for each object; one that is there stays with what most of its looks are of.

        Args:
            objects: Number of the object of each raw trial, and of some to come.
        """
        looks: Counter[tuple[int, str]] = Counter()
        for trial, name, number in zip(self.learner.trials, self.learner.owners, objects, strict=False):
            looks[number, name] += len(trial.detections)
        names: dict[int, str] = {}
        # Of as many looks, the object that was met first keeps the name.
        for (number, name), _ in sorted(looks.items(), key=lambda entry: -entry[1]):
            if number not in names and name not in names.values():
                names[number] = name
        for number in dict.fromkeys(objects):
            if number not in names:
                taken = {*self._graphs, *self._dropped, *names.values()}
                new = (f"object-{index:03d}" for index in itertools.count(len(taken)))
                names[number] = next(name for name in new if name not in taken)
        return names

    @property
    def log_erring_weights(self) -> tuple[float, float]:
        """Ln of the weight of the model in which looks err, and of the one in which they are nearly always right.

        Both are weighed by the evidence of all raw trials, each taken for one of a fresh object. Where symbols repeat
        within a pattern there is only the former.
        """
        if abs(self.gain) > OUTDONE:
            return (0.0, -np.inf) if self.gain > 0 else (-np.inf, 0.0)
        return -float(np.logaddexp(0.0, -self.gain)), -float(np.logaddexp(0.0, self.gain))

    @property
    def gain(self) -> float:
        """How many nats the model in which looks err is ahead; ∞ where there is no other."""
        if self._gain is not None:
            return self._gain
        if not self.assumptions.alphabet.exclusive:
            return np.inf
        # Trials that came in a file without what was sampled are not sampled before there is another one.
        return 2 * MISTAKEN if self.learner.trials else 0.0

    def _weigh(self, *, anew: bool) -> None:
        """Weigh the models against each other, or, if not anew, see whether errors are a structure's mistakes."""
        if not self.assumptions.alphabet.exclusive:
            self._gain = np.inf
            return
        if anew:
            self._gain = self.evidence.log_evidence - self.learner.log_evidence
        # However much it explains, it is not believed if its errors are the structure's and not the detector's.
        if self.evidence.is_mistaken:
            self._gain = min(self.gain, MISTAKEN)

    def _merge_shared(self, keep: str, drop: str) -> tuple[int, ...]:
        trials = tuple(number for number, owner in enumerate(self.learner.owners) if owner == drop)
        self.learner.hand_over(dict.fromkeys(trials, keep))
        self.evidence.forget_verdict()
        return trials

    def _unmerge_shared(self, merge: Merge) -> None:
        self.learner.hand_over(dict.fromkeys(merge.trials, merge.dropped.name))
        self.evidence.forget_verdict()

    def _rename_shared(self, old: str, new: str) -> None:
        self.learner.hand_over({number: new for number, owner in enumerate(self.learner.owners) if owner == old})
        self.evidence.forget_verdict()
        self._reassignments = [
            each._replace(old=new if each.old == old else each.old, new=new if each.new == old else each.new)
            for each in self._reassignments
        ]

    def _under(self, assumptions: Assumptions, labels: Relabelling) -> StructuredMemory:
        """Return a memory of the same under another alphabet; what was sampled is sampled again when asked for."""
        plain, known = super()._under(assumptions, labels), self.learner
        learner = StructureLearner(assumptions, known.seed)
        learner.n_evaluations = known.n_evaluations
        trials = [trial.relabelled(labels) for trial in known.trials]
        learner.restore(known.owners, trials, known.candidates, known.rates, known.noise)
        memory = StructuredMemory(assumptions, plain, learner, plain.merges, plain.sense)
        memory.restore_evidence(None, self._gain, self._reassignments)
        return memory

    def become(self, other: RobotMemory) -> None:
        """Have what another memory has; if that has no structure, none is learned yet."""
        super().become(other)
        known = other.learner if isinstance(other, StructuredMemory) else None
        self.learner = known or StructureLearner(self.assumptions)
        if isinstance(other, StructuredMemory):
            self.evidence, self._gain = other.evidence, other._gain
            self._reassignments = list(other._reassignments)

    def copy(self) -> StructuredMemory:
        """Return a memory that can learn without touching this one."""
        graphs = (graph.copy() for graph in self)
        sense = self._sense_copied()
        twin = StructuredMemory(self.assumptions, graphs, copy.deepcopy(self.learner), self.merges, sense)
        twin.evidence, twin._gain = self.evidence.copy(twin.learner), self._gain
        twin._reassignments = list(self._reassignments)
        return twin

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, RobotMemory):
            return NotImplemented
        if not isinstance(other, StructuredMemory):
            return False
        if super().__eq__(other) is not True or not self.learner.same_as(other.learner):
            return False
        return self._sampled() == other._sampled()

    def _sampled(self) -> tuple[object, ...]:
        saved = self.evidence.saved()
        return self.reassignments, None if saved is None else (saved.chains, saved.weights, saved.n_trials)

    def _more_to_say(self) -> str:
        believed = self.learner.believed(self.names)
        weights = f"with weights {', '.join(f'{each.weight:.2f}' for each in believed)}" if believed else "none"
        return f"; {len(self.learner.trials)} raw trials; structures believed in: {weights}"

    def __repr__(self) -> str:
        return (
            f"StructuredMemory({len(self)} of {self.assumptions.n_objects} objects, {len(self.learner.trials)} trials)"
        )


def memory_for(parameters: ModelParameters, memory: RobotMemory) -> RobotMemory:
    """Return a memory with the ATGs of ``memory`` that learns what the parameters say is to be learned.

    If ``memory`` is kept in a file, it is the new one that is kept there from here on.
    """
    if parameters.learn_structure and not isinstance(memory, StructuredMemory):
        structured = StructuredMemory(memory.assumptions, memory, merges=memory.merges, sense=memory.sense)
        structured._keeper, memory._keeper = memory._keeper, None
        return structured
    return memory
