from .assessment import (
    LEFT_OUT as LEFT_OUT,
    PAIRED as PAIRED,
    PERFECT as PERFECT,
    Assessment as Assessment,
    Selection as Selection,
    assess as assess,
    assess_each as assess_each,
    select_proxy as select_proxy,
)
from .catalogue import (
    ALL as ALL,
    MEASURES as MEASURES,
    POD_IMAGE as POD_IMAGE,
    POD_POSE as POD_POSE,
    PODS as PODS,
    PPV as PPV,
    PRPV as PRPV,
    SRCC as SRCC,
    Measure as Measure,
    Measured as Measured,
)
from .comparison import (
    Comparison as Comparison,
    compare as compare,
    in_common as in_common,
    start_of as start_of,
    starts_of as starts_of,
)
from .decision import (
    Asked as Asked,
    Decision as Decision,
    Difference as Difference,
    Panel as Panel,
    Together as Together,
    chosen as chosen,
    compare_savings as compare_savings,
    decide as decide,
    mmrv_conventions as mmrv_conventions,
)
from .expectation import (
    Donors as Donors,
    Estimate as Estimate,
    Expectation as Expectation,
    donors_of as donors_of,
    expect as expect,
    expected_differences as expected_differences,
)
from .noise import (
    Chance as Chance,
    NoiseFloor as NoiseFloor,
    SuccessRates as SuccessRates,
    chance as chance,
    floor_of_repeats as floor_of_repeats,
)
from .pairs import Prpv as Prpv, dominance as dominance, prpv_of_means as prpv_of_means
from .predictivity import pod_of_images as pod_of_images, pod_of_poses as pod_of_poses, ppv_of_means as ppv_of_means
from .resampling import (
    Ends as Ends,
    bootstrap_means as bootstrap_means,
    in_blocks as in_blocks,
    interval as interval,
    why_not_repeated as why_not_repeated,
)
from .saving import Saving as Saving, saving_of as saving_of
from .sequential import Plan as Plan, Sequential as Sequential, sequential_test as sequential_test
