import pytest

import slipcore
import slipcore.calibration
from slipcore.detection.batch import FixedLagSmoother


def test_a_former_name_still_works_and_names_its_successor() -> None:
    with pytest.warns(DeprecationWarning, match="slipcore.Hindsight is now FixedLagSmoother"):
        assert slipcore.Hindsight is FixedLagSmoother


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(AttributeError, match="no attribute 'Foresight'"):
        _ = slipcore.Foresight


def test_the_former_name_of_a_press_that_is_refused_still_works_and_warns() -> None:
    for module in (slipcore, slipcore.calibration):
        with pytest.warns(DeprecationWarning, match="ImpurePress is now InvalidPress"):
            assert module.ImpurePress is slipcore.InvalidPress
    with pytest.raises(AttributeError, match="'unheard_of'"):
        slipcore.calibration.unheard_of  # noqa: B018
