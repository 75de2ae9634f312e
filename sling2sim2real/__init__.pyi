# The public names, each once, and the module that has it.
from .api.csv_folder import episode_from_csv as episode_from_csv
from .api.episodes import episode_from_arrays as episode_from_arrays
from .api.episodes import read_mcap as read_mcap
from .api.identification import Identification as Identification
from .api.identification import Interval as Interval
from .api.identify import identify as identify
from .api.launching import Aim as Aim
from .api.launching import Launch as Launch
from .api.launching import aim as aim
from .api.launching import launch as launch
from .api.model import Band as Band
from .api.model import Model as Model
from .api.model import Theta as Theta
from .api.objective import Objective as Objective
from .api.rehearsal import rehearse as rehearse
from .api.simulation import Simulation as Simulation
from .api.simulation import pull as pull
from .api.simulation import simulate as simulate
from .api.simulation import simulate_batch as simulate_batch
from .base.errors import UserError as UserError
from .episode.episode import Episode as Episode
from .exporting.export import Exported as Exported
from .exporting.export import export as export
from .identification.posterior.launches import Observed as Observed
from .identification.results.theta import Mounting as Mounting
from .settings import Settings as Settings
from .simulator.model import LaunchHistory as LaunchHistory

__version__: str
