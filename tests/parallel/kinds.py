"""All models that tests/parallel/test_models.py runs, by name."""

from __future__ import annotations

from tests.blocks.models import MODELS as BLOCKS
from tests.bolts.models import MODELS as BOLTS
from tests.coupled.models import MODELS as COUPLED
from tests.flow.models import MODELS as FLOW
from tests.heat.models import MODELS as HEAT
from tests.liners.models import MODELS as LINERS
from tests.moisture.models import MODELS as MOISTURE
from tests.parallel.model import Model
from tests.proppant.models import MODELS as PROPPANT
from tests.space.models import MODELS as SPACE

KINDS: dict[str, Model] = BLOCKS | BOLTS | LINERS | FLOW | PROPPANT | HEAT | MOISTURE | COUPLED | SPACE
