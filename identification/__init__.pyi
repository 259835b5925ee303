from .design.experiment import Advice as Advice
from .design.experiment import advise as advise
from .design.reduced import (
    ReducedIdentification as ReducedIdentification,
)
from .design.reduced import (
    identify_reduced as identify_reduced,
)
from .design.reduction import (
    Reduction as Reduction,
)
from .design.reduction import (
    backward_elimination as backward_elimination,
)
from .design.reduction import (
    forward_selection as forward_selection,
)
from .design.sensitivity import (
    sensitivity as sensitivity,
)
from .estimators.coefficient_history import (
    CoefficientHistory as CoefficientHistory,
)
from .estimators.coefficient_history import (
    coefficient_history as coefficient_history,
)
from .estimators.comparators import LeastSquares as LeastSquares
from .estimators.comparators import (
    LinearSupportVectorMachine as LinearSupportVectorMachine,
)
from .estimators.comparators import RidgeRegression as RidgeRegression
from .estimators.kernel_residual import KernelResidual as KernelResidual
from .estimators.library import (
    GaussianProcess as GaussianProcess,
)
from .estimators.library import (
    KalmanRegression as KalmanRegression,
)
from .estimators.library import (
    LassoRegression as LassoRegression,
)
from .estimators.library import (
    RelevanceRegression as RelevanceRegression,
)
from .estimators.lssvm import (
    LSSVM as LSSVM,
)
from .estimators.lssvm import (
    TruncatedLSSVM as TruncatedLSSVM,
)
from .estimators.polynomial import (
    polynomial_coefficients as polynomial_coefficients,
)
from .estimators.recursive import (
    MultiInnovationLeastSquares as MultiInnovationLeastSquares,
)
from .estimators.recursive import (
    RecursiveLeastSquares as RecursiveLeastSquares,
)
from .estimators.recursive import (
    StochasticGradient as StochasticGradient,
)
from .estimators.rm_svm import RMSVM as RMSVM
from .estimators.tuned import TunedLSSVM as TunedLSSVM
from .options import Options as Options
from .pipeline import identify as identify
from .regression.forces import (
    ForceRegression as ForceRegression,
)
from .regression.forces import (
    force_regression as force_regression,
)
from .regression.forces import (
    identify_forces as identify_forces,
)
from .regression.preprocess import Preprocessing as Preprocessing
from .regression.samples import Samples as Samples
from .regression.samples import Sampling as Sampling
from .regression.samples import build_samples as build_samples
from .result import IdentificationResult as IdentificationResult
from .search import (
    ArtificialBeeColony as ArtificialBeeColony,
)
from .search import (
    DifferentialEvolution as DifferentialEvolution,
)
from .search import (
    GridSearch as GridSearch,
)
from .search import (
    ParticleSwarm as ParticleSwarm,
)
from .search import (
    SearchResult as SearchResult,
)
from .search import (
    minimise as minimise,
)
from .simulation_error.prior_knowledge import PriorKnowledge as PriorKnowledge
from .simulation_error.refinement import Refinement as Refinement
from .uncertainty.uncertainty import Uncertainty as Uncertainty
from .validation.comparison import (
    Comparison as Comparison,
)
from .validation.comparison import (
    compare_methods as compare_methods,
)
from .validation.comparison import (
    cross_validate as cross_validate,
)
