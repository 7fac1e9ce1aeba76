"""The thresholds of a diagnosis, all in one place."""

from dataclasses import dataclass

from jaxink.display.brief import brief_repr
from jaxink.measurement import LEAST_PROBABILITY, SIGMA_TOLERANCE


@dataclass(frozen=True)
class SearchPolicy:
    """Thresholds of a diagnosis; the defaults are those that docs/manual/diagnosis.md states and measures.

    Parameters
    ----------
    noise_p
        A residual is not consistent with noise if the probability of its chi-square, or of one of the
        statistics of its spatial and serial correlation, is below this.
    sigma_tolerance
        Factor to which stated standard deviations are trusted: a residual that exceeds them by less is not a
        misfit.
    fewest_pairs
        Fewest pairs of readings that must be equal for which they are compared.
    shortest_scan
        Scans, or graphs of neighbours, with fewer entries are not tested for correlation.
    ljung_box_lags
        Largest lag of the Ljung-Box statistic.
    quiet_level
        Significance level of the screen, in place of that of the options, if all tests find the residual
        consistent with noise (`noise_p`): of so many tests, one is passed by chance now and then.
    largest_degenerate_fraction
        Screen: above this degenerate fraction a candidate is hardly testable.
    limit_multiples
        Multiples of a linear detection limit at which refits verify it, the largest first.
    limit_decrement
        These refits end where a step promises to lower chi-square by less than this, relative to chi-square
        per degree of freedom; their data have no noise.
    far_reduced_chi_square
        Above this reduced chi-square the linear screen is unreliable, and every testable candidate is
        refitted.
    refit_starts
        Refits: number of settings of an effect, the most promising ones, from which its refit starts.
    rival_minima
        Refits of effects of the particles: number of other minima of the declared fit from which they start,
        too, where its misfit has several along a parameter.
    lower_minimum
        The corrected model is fitted from these minima, too; it goes to one that is this much lower in
        chi-square.
    scanned_sizes, scan_jacobians, scanned_kept
        Refits of effects of the particles, if nothing explains the data at minima of the declared model:
        number of sizes of particles at which the others are fitted, by so many Jacobians, and of the best
        ones, from which all are fitted.
    refit_jacobians
        Largest number of Jacobians for each start, before the leading refits are continued.
    same_prediction
        Relative difference up to which two programs compute the same model.
    own_program_share, own_program_share_far
        Effects with a program of their own are refitted if their predicted decrease in chi-square is at least
        this share of the best; the second applies if the fit is far off and nothing explains the data yet.
    most_own_programs
        Largest number of those effects that are refitted after one screen.
    polish_share, most_polished
        Refits that are continued: those with at least this share of the best decrease, and how many.
    polish_jacobians, polish_rounds, polish_gain
        A refit is continued by `polish_jacobians` at a time, for at most `polish_rounds`, and only while a
        round lowers chi-square by at least `polish_gain`.
    converged_jacobians
        Largest number of Jacobians with which the accepted refit is continued to convergence.
    polish_decrement, held_out_decrement
        Continued refits, and fits without some of the points, end where a step promises to lower chi-square
        by less than this, relative to chi-square per degree of freedom: they are compared by whole units of
        chi-square, and a search along a flat valley would take dozens of Jacobians more.
    held_out_jacobians
        Largest number of Jacobians of a fit without some of the points; it starts at the fit of all points.
    enough_reduced_chi_square, enough_share
        Below this chi-square per point, or this share of the misfit, an effect is sufficient: neither pairs
        nor further effects with programs of their own are tried.
    most_foreseen
        Otherwise, number of leading effects that are combined with a second one, and of second ones for each.
    most_tried
        Acceptance: number of classes of candidates tried after one screen.
    clear_errors
        Smallest distance of a strength from the declared model, in standard errors.
    class_delta_chi_square
        Refits, or predicted decreases, that differ by less in chi-square are indistinguishable: they form one
        class.
    most_rivals
        Number of candidates fitted in place of an effect to determine its class in the presence of the
        others.
    fewest_scans
        Fewest scans for which whole scans are held out in turn; otherwise blocks within scans are.
    held_out_blocks
        Number of these blocks in each scan.
    coverage_errors
        Findings: a parameter is undetermined if misfit and noise may have moved it to a bound of its range,
        at this many standard deviations; 1.96 cover 95 %.
    decisive_chi_square
        Smallest chi-square with which a further measurement distinguishes two effects; 9 is three standard
        errors.
    one_side_share
        Location of the residual: share of its power above which one side alone is named.
    band_share
        Share of the sum of squares by which a division must exceed the constant mean to be named.
    elsewhere_share
        Share of the power outside a band above which an opposite sign there is mentioned.
    prevailing_mean
        A sign prevails if the mean exceeds this share of the root mean square.
    same_band_mean
        A neighbouring band is merged with the strongest if its mean is at least this share of the other.
    larger_ratio, larger_errors
        A level is reported as larger if its mean exceeds that of the rest by this factor and by this many
        standard errors.
    """

    __repr__ = brief_repr

    noise_p: float = LEAST_PROBABILITY
    sigma_tolerance: float = SIGMA_TOLERANCE
    fewest_pairs: int = 10
    shortest_scan: int = 8
    ljung_box_lags: int = 10
    quiet_level: float = 1e-3
    largest_degenerate_fraction: float = 0.98
    limit_multiples: tuple[float, ...] = (16.0, 8.0, 4.0, 2.0)
    limit_decrement: float = 0.1
    far_reduced_chi_square: float = 3.0
    refit_starts: int = 2
    rival_minima: int = 2
    lower_minimum: float = 0.1
    scanned_sizes: int = 24
    scan_jacobians: int = 5
    scanned_kept: int = 3
    refit_jacobians: int = 12
    same_prediction: float = 1e-2
    own_program_share: float = 0.75
    own_program_share_far: float = 0.25
    most_own_programs: int = 4
    polish_share: float = 0.4
    most_polished: int = 6
    polish_jacobians: int = 10
    polish_rounds: int = 4
    polish_gain: float = 0.4
    converged_jacobians: int = 40
    polish_decrement: float = 1e-3
    held_out_decrement: float = 1e-4
    held_out_jacobians: int = 20
    enough_reduced_chi_square: float = 1.3
    enough_share: float = 0.01
    most_foreseen: int = 4
    most_tried: int = 3
    clear_errors: float = 2.0
    class_delta_chi_square: float = 4.0
    most_rivals: int = 6
    fewest_scans: int = 3
    held_out_blocks: int = 6
    coverage_errors: float = 1.96
    decisive_chi_square: float = 9.0
    one_side_share: float = 0.8
    band_share: float = 0.25
    elsewhere_share: float = 0.25
    prevailing_mean: float = 0.5
    same_band_mean: float = 0.25
    larger_ratio: float = 1.5
    larger_errors: float = 3.0


DEFAULT_POLICY = SearchPolicy()
