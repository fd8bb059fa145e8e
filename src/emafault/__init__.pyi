from .api.actuator import Actuator as Actuator
from .api.diagnosis import Diagnosis as Diagnosis
from .api.diagnosis import diagnose as diagnose
from .api.identification import Identification as Identification
from .api.identification import identify as identify
from .api.machine import MachineDiagnoses as MachineDiagnoses
from .api.machine import MachineDiagnosis as MachineDiagnosis
from .api.plan import Plan as Plan
from .api.plan import plan as plan
from .api.recordings import Recordings as Recordings
from .api.recordings import example as example
from .api.recordings import read as read
from .api.table import Table as Table
from .errors import InputError as InputError
from .io.recording import Recording as Recording

__version__: str
