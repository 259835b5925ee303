from .design.experiment import Advice as Advice
from .design.experiment import advise as advise
from .design.reduction import (
    ReducedIdentification as ReducedIdentification,
)
from .design.reduction import (
    Reduction as Reduction,
)
from .design.reduction import (
    backward_elimination as backward_elimination,
)
from .design.reduction import (
    identify_reduced as identify_reduced,
)
from .estimators.kernel_residual import KernelResidual as KernelResidual
from .estimators.lssvm import (
    LSSVM as LSSVM,
)
from .estimators.lssvm import LeastSquares as LeastSquares
from .estimators.lssvm import RidgeRegression as RidgeRegression
from .estimators.lssvm import (
    TruncatedLSSVM as TruncatedLSSVM,
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
from .judging.uncertainty import Uncertainty as Uncertainty
from .models.prior_knowledge import PriorKnowledge as PriorKnowledge
from .models.refinement import Refinement as Refinement
from .pipeline import identify as identify
from .pipeline.options import Options as Options
from .pipeline.result import IdentificationResult as IdentificationResult
from .report.view import write_report as write_report
from .samples.prediction import predict as predict
from .samples.preprocess import Preprocessing as Preprocessing
from .samples.samples import Samples as Samples
from .samples.samples import Sampling as Sampling
from .samples.samples import build_samples as build_samples
