import subprocess
import sys
from typing import Any

import numpy as np
import pytest


def test_a_model_is_a_table_with_intervals_and_units(make_model: Any) -> None:
    made = make_model()
    table = made.to_dataframe()
    assert list(table.index) == ["beta0", "beta1", "beta2", "sigma"]
    assert list(table.unit) == ["1", "s/m", "1/N", "1"]
    assert np.allclose(table.estimate, [*made.coefficients, made.scale], rtol=1e-12)
    assert np.allclose(table.loc[:"beta2", ["low", "high"]], made.interval(0.95), rtol=1e-12)
    assert np.allclose(table.loc["sigma", ["low", "high"]].astype(float), made.scale_interval(0.95), rtol=1e-12)
    assert table.attrs == {"method": made.method, "samples": made.n}


def test_a_model_is_labelled_by_coefficient(make_model: Any) -> None:
    made = make_model()
    data = made.to_xarray()
    assert float(data.coefficients.sel(coefficient="beta1")) == made.coefficients[1]
    assert float(data.covariance.sel(coefficient="beta0", other="beta2")) == made.covariance[0, 2]
    assert data.attrs == {"method": made.method, "samples": made.n}


def test_a_notebook_shows_what_the_model_rests_on(make_model: Any) -> None:
    made = make_model()
    shown = made._repr_html_()
    assert made.advice in shown
    assert shown.count("<tr>") == 5
    assert ("†" in shown) == (not made.identifiable.all())


def test_the_interval_of_the_scatter_holds_it_and_widens_with_fewer_degrees_of_freedom(make_model: Any) -> None:
    from scipy import stats

    made = make_model()
    low, high = made.scale_interval(0.9)
    freedom = made.scatter_degrees_of_freedom
    assert low < made.scale < high
    assert stats.chi2.cdf(freedom * (made.scale / high) ** 2, freedom) == pytest.approx(0.05, abs=1e-9)
    assert stats.chi2.cdf(freedom * (made.scale / low) ** 2, freedom) == pytest.approx(0.95, abs=1e-9)


def test_a_scatter_that_is_known_has_no_width(make_model: Any) -> None:
    made = make_model(scatter_degrees_of_freedom=np.inf)
    assert made.scale_interval() == (made.scale, made.scale)


def test_a_table_without_its_library_names_the_extra(make_model: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ModuleNotFoundError) as found:
        make_model().to_dataframe()
    assert found.value.__notes__ == ["pandas comes with the extra `notebook` of stiction-client"]


def test_the_client_loads_neither_pandas_nor_xarray_until_it_is_asked() -> None:
    code = "import stiction_client, sys; print({'pandas', 'xarray'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
