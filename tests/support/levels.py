"""A candidate iso-value that passes all tests for clear ones; tests derive others from it."""

from stereocell.isosurface.level import Level

# contrast five times the noise, slopes of a blur of 2.5 voxels, in no valley
CLEAR = Level(
    value=100.0,
    inside=150.0,
    outside=50.0,
    snr=5.0,
    sharpness=0.16,
    separation=0.75,
    dip=1.0,
    stability=0.9,
    share=0.3,
    rise=3.0,
    stands_out=3.0,
)
