"""A space of features in which looks at one thing scatter alike in all directions.

Two covariances are calibrated on things that are not the ones to be told apart later: within a class, over looks at one
thing, and between classes, over things (Ioffe, *Probabilistic linear discriminant analysis*, ECCV 2006). The projection
makes the first the identity and the second diagonal.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from atg_fg.core.checks import finite_array, floats, plain_text, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray, read_only

#: D, at most.
MOST_DIMENSIONS: Final = 1000
#: Directions in which looks scatter less than this share of the widest one are left out: there is nothing in them.
_LEAST_SCATTER: Final = 1e-3
#: Share of the mean variance that is added to each direction within classes, so that none is trusted without limit.
_SHRINKAGE: Final = 0.05
#: Encoded readings are rounded to so many decimals, so that a record of them says all there is to know.
DECIMALS: Final = 4


@dataclass(frozen=True, eq=False)
class FeatureSpace:
    """A linear map of features, z = (x − mean) · projection.

    Attributes:
        features: Name of what makes the features.
        mean: Shape [F].
        projection: Shape [F, D].
        between: Variance of the means of classes in each direction, where that of looks at one thing is 1, shape [D].

    Raises:
        InvalidInputError: Shapes that do not fit, numbers that are not finite, or a variance that is not above 0.
    """

    features: str
    mean: FloatArray
    projection: FloatArray
    between: FloatArray

    def __post_init__(self) -> None:
        for name in ("mean", "projection", "between"):
            array = floats(getattr(self, name), f"feature space: {name}", "numbers").copy()
            object.__setattr__(self, name, read_only(array))
        plain_text(self.features, "feature space: features")
        shapes = (self.mean.shape, self.projection.shape, self.between.shape)
        if self.projection.ndim != 2 or shapes != (
            self.projection.shape[:1],
            self.projection.shape,
            self.projection.shape[1:],
        ):
            raise InvalidInputError(f"feature space: shapes {shapes}; expected [F], [F, D] and [D]")
        if not 1 <= len(self.between) <= MOST_DIMENSIONS:
            raise InvalidInputError(f"feature space: {len(self.between)} dimensions; expected 1 to {MOST_DIMENSIONS}")
        finite = all(np.isfinite(each).all() for each in (self.mean, self.projection, self.between))
        if not finite or not (self.between > 0).all():
            raise InvalidInputError("feature space: expected finite numbers, and variances above 0")

    @property
    def n_features(self) -> int:
        """F."""
        return len(self.mean)

    @property
    def n_dimensions(self) -> int:
        """D."""
        return len(self.between)

    @classmethod
    def calibrated(cls, features: str, looks: ArrayLike, n_dimensions: int) -> FeatureSpace:
        """Return the space of features of which there are several looks at each of several things.

        Args:
            features: Name of what made them.
            looks: Shape [C, R, F]: R looks at each of C things.
            n_dimensions: D at most; directions in which things do not differ are left out.

        Raises:
            InvalidInputError: Fewer than two things or looks, or features that are not finite or all alike.
        """
        place, expected = (
            f"calibration of {features!r}",
            "as many features of each look, at as many looks of each thing",
        )
        values = floats(looks, place, expected)
        whole_number(n_dimensions, "dimensions", 1)
        if values.ndim != 3 or min(values.shape[:2]) < 2 or not np.isfinite(values).all():
            raise InvalidInputError(
                f"{place}: features of shape {values.shape}; expected finite ones, at least two looks at each of "
                "two things"
            )
        mean = values.mean(axis=(0, 1))
        centres = values.mean(axis=1)
        residuals = (values - centres[:, None]).reshape(-1, values.shape[2])
        # First to the directions in which anything varies, then so that looks at one thing scatter alike in all.
        _, scatter, directions = np.linalg.svd((values - mean).reshape(residuals.shape), full_matrices=False)
        directions = directions[scatter > _LEAST_SCATTER * float(scatter[0])].T
        n_free = residuals.shape[0] - values.shape[0]
        within = np.atleast_2d((residuals @ directions).T @ (residuals @ directions) / n_free)
        if not float(np.trace(within)) > _LEAST_SCATTER**2 * float(scatter[0]) ** 2:
            raise InvalidInputError(f"{place}: all looks at a thing are the same; expected looks that differ")
        variance, axes = np.linalg.eigh(within)
        variance = (1 - _SHRINKAGE) * variance + _SHRINKAGE * float(variance.mean())
        whitening = directions @ (axes / np.sqrt(variance))
        between, axes = np.linalg.eigh(np.atleast_2d(np.cov(((centres - mean) @ whitening).T)))
        between = between - 1.0 / values.shape[1]  # means of R looks scatter by themselves
        best = [each for each in np.argsort(-between)[:n_dimensions] if between[each] > 0]
        if not best:
            raise InvalidInputError(f"{place}: things do not differ; expected features that tell them apart")
        return cls(features, mean, whitening @ axes[:, best], between[best])

    def encode(self, features: ArrayLike, place: str = "features") -> FloatArray:
        """Return the point of a look, shape [D], rounded to ``DECIMALS``.

        Raises:
            InvalidInputError: Of another length than F, or not finite.
        """
        values = finite_array(features, place, self.mean.shape, f"{self.n_features} numbers, as of {self.features!r}")
        point: FloatArray = np.round((values - self.mean) @ self.projection, DECIMALS)
        return point

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, FeatureSpace):
            return NotImplemented
        arrays = zip(self._arrays(), other._arrays(), strict=True)
        return self.features == other.features and all(np.array_equal(ours, theirs) for ours, theirs in arrays)

    def _arrays(self) -> tuple[FloatArray, ...]:
        return self.mean, self.projection, self.between

    def to_document(self) -> dict[str, Any]:
        """Return this space as JSON knows it."""
        return {
            "features": self.features,
            "mean": self.mean.tolist(),
            "projection": self.projection.tolist(),
            "between": self.between.tolist(),
        }
