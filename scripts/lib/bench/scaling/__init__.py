"""Scaling on paper: parts of the step measured here, a model of the step made of them, its checks, its forecast.

`measure` runs on our ranks and leaves lines, `model` is arithmetic, `fit` makes the model from lines and checks it,
`report` writes docs/scaling.md. Started by `scripts/bench scaling`.
"""
