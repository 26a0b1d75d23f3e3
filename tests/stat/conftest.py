# SPDX-License-Identifier: Apache-2.0
import farm
import image
import pytest


@pytest.fixture(scope="session")
def pixels_of():
    """Renders a scene on a farm that the whole session shares; tells its pixels."""
    with farm.Farm(processes=2) as shared:
        yield lambda body: image.read(shared.render(body))
