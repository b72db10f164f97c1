import pytest

import chaic


@pytest.fixture(scope="session")
def episode() -> chaic.Episode:
    return chaic.Episode("low_target/train/00")
