"""The thresholds by which a diagnosis decides, all in one place."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SearchPolicy:
    """Thresholds of a diagnosis; the defaults are those that docs/diagnosis.md states and measures.

    Parameters
    ----------
    noise_p
        Is anything left? A residual is not consistent with noise where the probability of its chi-square,
        or of one of the statistics of its order, is below this.
    sigma_tolerance
        Stated standard deviations are taken to be right within this factor: a residual that is larger than
        stated by less says more of the statement than of the model.
    fewest_pairs
        Pairs of readings that must agree are compared where there are at least so many.
    shortest_scan
        Scans, or graphs of neighbours, with fewer entries are not tested for order.
    ljung_box_lags
        Largest lag of the Ljung-Box statistic.
    hardly_absorbed
        Screen: a candidate of which the free parameters imitate more than this share is hardly testable.
    limit_multiples
        Multiples of a linear detection limit at which refits see whether it holds, the largest first.
    far_reduced_chi_square
        From this reduced chi-square on, the parameters of the fit may be far from those of a better model:
        the linear screen says little then, and every testable candidate is refitted.
    refit_starts
        Refits: settings of an effect, the most promising ones, from which its refit starts.
    refit_jacobians
        Jacobians that each start may take, before the leading refits are followed to their minima.
    same_prediction
        Relative difference up to which two programs compute the same model.
    own_program_share, own_program_share_far
        Effects with a program of their own are refitted where they promise at least this share of the best
        fall of chi-square; the second where the fit is far off and nothing yet explains the data.
    most_own_programs
        Most of those effects that are refitted at one stage.
    polish_share, most_polished
        Refits followed to their minima: those that gain at least this share of the best, and how many.
    enough_reduced_chi_square
        Below this chi-square per point an effect explains enough: no pairs are looked at, and no more
        effects with programs of their own.
    most_foreseen
        Otherwise so many leading effects are followed up by so many second ones.
    most_tried
        Acceptance: so many classes of candidates are tried at one stage.
    clear_errors
        A strength has to be this many standard errors from the declared model.
    told_apart
        Refits, and predicted falls, that differ by less in chi-square are not told apart: one class.
    most_rivals
        Candidates that are fitted in the place of an effect, to know its class beside all others.
    fewest_scans
        Whole scans are held out in turn where there are at least so many; otherwise blocks within scans.
    held_out_blocks
        Blocks of each scan, then.
    coverage_errors
        Findings: a parameter that misfit and noise may have shifted to a bound of its range, this many
        standard deviations to either side, is not determined; 1.96 hold 95 %.
    telling_chi_square
        Chi-square from which a further measurement would tell two effects apart; 9 is three standard errors.
    one_side_share
        Where the residual stands: share of its power that names one side alone.
    band_share
        Share of the sum of squares by which a division must beat the plain mean to be named.
    elsewhere_share
        Share of the power outside of a band that makes the opposite sign there worth a word.
    prevailing_mean
        A sign prevails where the mean exceeds this share of the root mean square.
    same_band_mean
        A neighbouring band belongs to the strongest where its mean is at least this share of that one's.
    larger_ratio, larger_errors
        A level is called larger where its mean exceeds that of the rest by this factor, and by so many
        standard errors.
    """

    noise_p: float = 1e-3
    sigma_tolerance: float = 1.1
    fewest_pairs: int = 10
    shortest_scan: int = 8
    ljung_box_lags: int = 10
    hardly_absorbed: float = 0.98
    limit_multiples: tuple[float, ...] = (16.0, 8.0, 4.0, 2.0)
    far_reduced_chi_square: float = 3.0
    refit_starts: int = 2
    refit_jacobians: int = 12
    same_prediction: float = 1e-2
    own_program_share: float = 0.75
    own_program_share_far: float = 0.25
    most_own_programs: int = 4
    polish_share: float = 0.4
    most_polished: int = 6
    enough_reduced_chi_square: float = 1.3
    most_foreseen: int = 4
    most_tried: int = 3
    clear_errors: float = 2.0
    told_apart: float = 4.0
    most_rivals: int = 6
    fewest_scans: int = 3
    held_out_blocks: int = 6
    coverage_errors: float = 1.96
    telling_chi_square: float = 9.0
    one_side_share: float = 0.8
    band_share: float = 0.25
    elsewhere_share: float = 0.25
    prevailing_mean: float = 0.5
    same_band_mean: float = 0.25
    larger_ratio: float = 1.5
    larger_errors: float = 3.0


DEFAULT_POLICY = SearchPolicy()
