"""The papers behind what a result was made with; each stands in docs/references.md, too."""

from collections.abc import Iterable

PAPERS = {
    "beaton1974": "Beaton and Tukey, The fitting of power series, meaning polynomials, Technometrics 16 (1974) 147",
    "bell2002": "Bell and McCaffrey, Bias reduction in standard errors for linear regression with multi-stage samples, "
    "Survey Methodology 28 (2002) 169",
    "blom1988": "Blom and Bar-Shalom, The interacting multiple model algorithm for systems with Markovian switching "
    "coefficients, IEEE Trans. Autom. Control 33 (1988) 780",
    "vanbrakel2014": "van Brakel, Robust peak detection algorithm using z-scores, Stack Overflow 22583391 (2014)",
    "carroll2006": "Carroll, Ruppert, Stefanski and Crainiceanu, Measurement Error in Nonlinear Models, 2nd ed. (2006)",
    "cappe2008": "Cappé, Douc, Guillin, Marin and Robert, Adaptive importance sampling in general mixture classes, "
    "Statistics and Computing 18 (2008) 447",
    "cattaneo1938": "Cattaneo, Sul contatto di due corpi elastici, Rend. Accad. Naz. Lincei 27 (1938) 342",
    "dong2019": "Dong, Ma, Donlon and Rodriguez, Maintaining grasps within slipping bounds by monitoring incipient "
    "slip, ICRA (2019) 3818",
    "foreman2013": "Foreman-Mackey, Hogg, Lang and Goodman, emcee: the MCMC hammer, Publ. Astron. Soc. Pac. 125 (2013) "
    "306",
    "garcia2018": "Garcia and Garcia, Determination of the elastic moduli of a single cell cultured on a rigid support "
    "by force microscopy, Biophys. J. 114 (2018) 2923",
    "gelman2006": "Gelman, Prior distributions for variance parameters in hierarchical models, Bayesian Analysis 1 "
    "(2006) 515",
    "gelman2013": "Gelman, Carlin, Stern, Dunson, Vehtari and Rubin, Bayesian Data Analysis, 3rd ed. (2013)",
    "goyal1991": "Goyal, Ruina and Papadopoulos, Planar sliding with dry friction, part 1: limit surface and moment "
    "function, Wear 143 (1991) 307",
    "hertz1882": "Hertz, Über die Berührung fester elastischer Körper, J. reine angew. Math. 92 (1882) 156",
    "jaeger1998": "Jäger, A new principle in contact mechanics, J. Tribol. 120 (1998) 677",
    "johnson1985": "Johnson, Contact Mechanics (1985)",
    "juarez2010": "Juárez and Steel, Model-based clustering of non-Gaussian panel data based on skew-t distributions, "
    "J. Bus. Econ. Stat. 28 (2010) 52",
    "khamis2018": "Khamis, Izquierdo Albero, Salerno, Shah Idil, Loizou and Redmond, PapillArray: an incipient slip "
    "sensor for dexterous robotic or prosthetic manipulation, Sens. Actuators A 270 (2018) 195",
    "kim1994": "Kim, Dynamic linear models with Markov-switching, J. Econometrics 60 (1994) 1",
    "lee1960": "Lee and Radok, The contact problem for viscoelastic bodies, J. Appl. Mech. 27 (1960) 438",
    "paper": "Li, Zhang, Huang, Li and Jiang, Modeling, simulation, and application of spatio-temporal characteristics "
    "detection in incipient slip",
    "liu2023": "Liu and Howe, Beyond Coulomb: stochastic friction models for practical grasping and manipulation, IEEE "
    "Robot. Autom. Lett. 8 (2023) 5140",
    "lubkin1951": "Lubkin, The torsion of elastic spheres in contact, J. Appl. Mech. 18 (1951) 183",
    "mindlin1949": "Mindlin, Compliance of elastic bodies in contact, J. Appl. Mech. 16 (1949) 259",
    "mindlin1953": "Mindlin and Deresiewicz, Elastic spheres in contact under varying oblique forces, J. Appl. Mech. "
    "20 (1953) 327",
    "popov2010": "Popov, Contact Mechanics and Friction (2010)",
    "rousseeuw2006": "Rousseeuw and Van Driessen, Computing LTS regression for large data sets, Data Mining and "
    "Knowledge Discovery 12 (2006) 29",
    "shinozuka1991": "Shinozuka and Deodatis, Simulation of stochastic processes by spectral representation, Appl. "
    "Mech. Rev. 44 (1991) 191",
    "song2014": "Song, Liu, Althoefer, Nanayakkara and Seneviratne, Efficient break-away friction ratio and slip "
    "prediction based on haptic surface exploration, IEEE Trans. Robot. 30 (2014) 203",
    "spence1975": "Spence, The Hertz contact problem with finite friction, J. Elasticity 5 (1975) 297",
    "sui2022": "Sui, Zhang, Li and Jiang, Incipient slip detection method for soft objects with vision-based tactile "
    "sensor, Measurement 203 (2022) 111906",
    "vehtari2021": "Vehtari, Gelman, Simpson, Carpenter and Bürkner, Rank-normalization, folding, and localization: an "
    "improved R̂, Bayesian Analysis 16 (2021) 667",
    "yohai1987": "Yohai, High breakdown-point and high efficiency robust estimates for regression, Ann. Stat. 15 "
    "(1987) 642",
    "li2023": "Li, Li and Jiang, Marker displacement method used in vision-based tactile sensors: a review, IEEE "
    "Sensors J. 23 (2023) 8042",
    "zhang2023": "Zhang, Sui, Zhang, Li and Jiang, A robust incipient slip detection method with vision-based tactile "
    "sensor based on local deformation degree, IEEE Sensors J. 23 (2023) 17200",
}
"""Every paper, by a short name."""

DETECTION = {
    "filter": ("blom1988", "kim1994", "mindlin1953"),
    "strain_rate": ("paper",),
    "strain_rate_literal": ("paper", "vanbrakel2014"),
    "rigid_fit": ("dong2019",),
    "local_deformation": ("zhang2023",),
    "deformation_gradient": ("sui2022",),
    "force_ratio": ("song2014",),
    "strain_threshold": ("paper",),
    "forces_only": ("cattaneo1938", "mindlin1949", "mindlin1953", "khamis2018"),
    "coarse": ("cattaneo1938", "mindlin1949", "mindlin1953", "jaeger1998", "khamis2018", "blom1988"),
}
"""Papers behind each method of detection."""

ESTIMATION = {
    "ols": ("bell2002", "liu2023"),
    "robust": ("yohai1987", "rousseeuw2006", "beaton1974", "bell2002"),
    "conjugate": ("gelman2013", "liu2023"),
    "hierarchical": ("gelman2006", "gelman2013", "liu2023"),
    "auto": ("gelman2006", "gelman2013", "liu2023", "yohai1987"),
    "bayes": ("foreman2013", "vehtari2021", "gelman2013", "liu2023"),
}
"""Papers behind each method of estimation."""

LIKELIHOODS = {
    "gaussian": ("gelman2013",),
    "hierarchical": ("gelman2006",),
    "student_t": ("juarez2010", "cappe2008"),
    "outlier": ("cappe2008", "gelman2013"),
    "errors_in_variables": ("carroll2006", "cappe2008"),
}
"""Papers behind each likelihood of ``bayes``, beside its own."""

EFFECTS = {
    "CylinderSurface": ("johnson1985",),
    "DroppedFrames": ("paper",),
    "ElasticObject": ("johnson1985",),
    "FiniteLayer": ("garcia2018",),
    "FlatSurface": ("johnson1985",),
    "ForceNoise": ("carroll2006",),
    "FrictionPatch": ("popov2010",),
    "GelDrift": ("lee1960",),
    "LoadPath": ("mindlin1953",),
    "MarkerNoise": ("li2023",),
    "MeasuredSurface": ("popov2010",),
    "NormalTangentialCoupling": ("spence1975",),
    "ObjectMotion": ("goyal1991",),
    "PressingSpread": ("johnson1985",),
    "PressureFriction": ("liu2023",),
    "RandomFriction": ("shinozuka1991", "liu2023"),
    "RingSurface": ("johnson1985",),
    "SensorSampling": ("paper",),
    "SphereSurface": ("hertz1882",),
    "TangentialLoad": ("cattaneo1938", "mindlin1949"),
    "Torsion": ("lubkin1951",),
    "VelocityFriction": ("liu2023",),
    "Viscoelasticity": ("lee1960",),
    "WavySurface": ("johnson1985",),
}
"""Papers behind each effect of a simulated scene."""


def cited(*lists: Iterable[str]) -> tuple[str, ...]:
    """The papers of some lists of short names, each once, in their order."""
    return tuple(PAPERS[name] for name in dict.fromkeys(name for names in lists for name in names))
