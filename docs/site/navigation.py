"""The tree of pages of the site: captions, and pages without their ending."""

TUTORIALS = ("thrust_belt", "cracked_specimen", "curve_to_test", "cluster_job", "water", "heat")

NAVIGATION = {
    "Begin": [
        *(f"docs/tutorials/{page}" for page in TUTORIALS),
        "docs/notebooks", "docs/coming_from", "docs/from_pcdc", "docs/glossary",
    ],
    "How to": [
        "docs/howto", "docs/packages", "docs/running", "docs/cases", "docs/specimens", "docs/specimens_page",
        "docs/meshes", "docs/sections", "docs/surface", "docs/flexure", "docs/python", "docs/sweep", "docs/view",
        "docs/pictures",
        "docs/measure", "docs/stress_strain", "docs/zdemss", "docs/user_laws",
    ],
    "Reference": [
        "docs/zdem_reference", "docs/pcdc_reference", "docs/pcdc_online", "docs/options", "docs/python_reference",
        "docs/files", "docs/fields",
    ],
    "Theory": [
        "docs/physics", "docs/blocks", "docs/blocks_joints", "docs/blocks_space", "docs/blocks_fluid",
        "docs/blocks_heat", "docs/blocks_supports", "docs/blocks_coupling",
    ],
    "Evidence": [
        "docs/gallery", "docs/validation", "docs/benchmarks", "docs/scaling", "docs/reliability", "docs/wishes",
    ],
    "Inside": ["ARCHITECTURE", "CONTRIBUTING", "docs/writing", "CHANGELOG"],
    "中文": [
        "docs/index.zh", *(f"docs/tutorials/{page}.zh" for page in TUTORIALS), "docs/howto.zh", "docs/pcdc.zh",
        "docs/sweep.zh", "docs/sections.zh", "docs/surface.zh", "docs/flexure.zh", "docs/zdem_reference.zh",
        "docs/pcdc_reference.zh",
    ],
}  # fmt: skip
