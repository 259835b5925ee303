from .design.experiment import Advice as Advice, advise as advise
from .design.reduced import (
    ReducedIdentification as ReducedIdentification,
    identify_reduced as identify_reduced,
)
from .design.reduction import (
    Reduction as Reduction,
    backward_elimination as backward_elimination,
    forward_selection as forward_selection,
    sensitivity as sensitivity,
)
from .estimators.coefficient_history import (
    CoefficientHistory as CoefficientHistory,
    coefficient_history as coefficient_history,
)
from .estimators.lssvm import (
    LSSVM as LSSVM,
    TruncatedLSSVM as TruncatedLSSVM,
    polynomial_coefficients as polynomial_coefficients,
)
from .estimators.recursive import (
    MultiInnovationLeastSquares as MultiInnovationLeastSquares,
    RecursiveLeastSquares as RecursiveLeastSquares,
    StochasticGradient as StochasticGradient,
)
from .estimators.rm_svm import RMSVM as RMSVM
from .estimators.tuned import TunedLSSVM as TunedLSSVM
from .options import Options as Options
from .pipeline import identify as identify
from .regression.forces import (
    ForceRegression as ForceRegression,
    force_regression as force_regression,
    identify_forces as identify_forces,
)
from .regression.samples import Samples as Samples, build_samples as build_samples
from .result import IdentificationResult as IdentificationResult
from .search import (
    ArtificialBeeColony as ArtificialBeeColony,
    DifferentialEvolution as DifferentialEvolution,
    GridSearch as GridSearch,
    ParticleSwarm as ParticleSwarm,
    SearchResult as SearchResult,
    minimise as minimise,
)
from .validation.comparison import (
    Comparison as Comparison,
    compare_methods as compare_methods,
    cross_validate as cross_validate,
)
