from .errors import FpmatchError as FpmatchError
from .minutiae import Minutiae as Minutiae
from .minutiae import MinutiaKind as MinutiaKind
from .minutiae import RidgeField as RidgeField
from .minutiae import Template as Template
from .pointset.similarity import Similarity as Similarity
