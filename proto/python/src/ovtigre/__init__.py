"""Client of an ovtigre render farm: scenes in, pictures with error bars out."""

from ovtigre.farm import Farm
from ovtigre.job import Job
from ovtigre.picture import Layer, Picture
from ovtigre.problem import FarmUnreachable, JobFailed, Problem
from ovtigre.status import Curve, CurveRow, Status, Worker

__all__ = [
    "Curve",
    "CurveRow",
    "Farm",
    "FarmUnreachable",
    "Job",
    "JobFailed",
    "Layer",
    "Picture",
    "Problem",
    "Status",
    "Worker",
]
