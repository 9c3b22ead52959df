"""Every study of the list is one, under its own name."""

import pytest

from buckler.studies.kit import registry


@pytest.mark.parametrize("name", registry.STUDIES)
def test_a_study_of_the_list_has_its_three_names(name):
    study = registry.load(name)
    assert study.__name__.rpartition(".")[2] == name.replace("-", "_")
    assert study.__doc__ and registry.STUDIES[name].summary and callable(study.run) and callable(study.figure)
    assert study.Parameters() == study.Parameters()
