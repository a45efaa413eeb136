import pytest

import slipcore
from slipcore.detection.batch import FixedLagSmoother


def test_a_former_name_still_works_and_names_its_successor() -> None:
    with pytest.warns(DeprecationWarning, match="slipcore.Hindsight is now FixedLagSmoother"):
        assert slipcore.Hindsight is FixedLagSmoother


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(AttributeError, match="no attribute 'Foresight'"):
        _ = slipcore.Foresight
