"""Blocks in a Python program: the same files as the PCDC script, every command, errors, particles beside them, going
on."""

from __future__ import annotations

import importlib
import inspect
import re
import shutil
import warnings
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hpcdem.api import objects as api
from hpcdem.api import simulation
from hpcdem.api.simulation import Simulation
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import ScriptError
from hpcdem.io import checkpoint
from hpcdem.lang.pcdc import bindings, execute
from hpcdem.lang.pcdc.kinds import FunctionName
from hpcdem.lang.pcdc.table import PCDC
from hpcdem.physics.fdem import groups as g
from hpcdem.runtime.run_folder import RECORD
from tests.conftest import ROOT, Launcher
from tests.pcdc.fake import Bench
from tests.property.workers import Resident
from tests.short_push import contents
from tests.tables import each

# ---- every command ---------------------------------------------------------------------------------------------------

SAME: list[tuple[str, str]] = [
    ("pcdc model new", "sim.start()"),
    ("pcdc model new dim 3", "sim.start(dim=3)"),
    ("pcdc model save 'a.sav'", "sim.save('a.sav')"),
    ("pcdc model restore 'a.sav'", "sim.restore('a.sav')"),
    ("pcdc model gravity (0,-9.81)", "sim.gravity((0, -9.81))"),
    ("pcdc model option dynamic off collision on overlap relax large-strain off energy on",
     "sim.option(dynamic=False, collision=True, overlap='relax', large_strain=False, energy=True)"),
    ("pcdc model option mechanical off hydraulic on one-way on",
     "sim.option(mechanical=False, hydraulic=True, one_way=True)"),
    ("pcdc model option thermal off", "sim.option(thermal=False)"),
    ("pcdc model option proppant off", "sim.option(proppant=False)"),
    ("pcdc model time-step hydraulic 1e-3", "sim.time_step(hydraulic=1e-3)"),
    ("pcdc model time-step thermal 60", "sim.time_step(thermal=60)"),
    ("pcdc model sub-step mechanical 10 hydraulic 5", "sim.sub_step(mechanical=10, hydraulic=5)"),
    ("pcdc model sub-step mechanical 10 thermal 2", "sim.sub_step(mechanical=10, thermal=2)"),
    ("pcdc model time-step safety 0.5 mass-scaling 1e-6", "sim.time_step(safety=0.5, mass_scaling=1e-6)"),
    ("pcdc model time-step value 1e-7 auto off", "sim.time_step(value=1e-7, auto=False)"),
    ("pcdc model creep on dt 10 change 0.1 least 1 greatest 100",
     "sim.creep(True, dt=10, change=0.1, least=1, greatest=100)"),
    ("pcdc model units mm-MPa-s", "sim.units('mm-MPa-s')"),
    ("pcdc model rayleigh 0.05 frequency 12 part stiffness",
     "sim.rayleigh(0.05, frequency=12, part='stiffness')"),
    ("pcdc model creep off", "sim.creep(False)"),
    ("pcdc model plane-stress", "sim.plane_stress()"),
    ("pcdc model plane-strain", "sim.plane_strain()"),
    ("pcdc model step 100", "sim.step(100)"),
    ("pcdc model solve ratio 1e-6 window 10 limit 0 on-failure continue",
     "sim.solve(ratio=1e-6, window=10, limit=0, on_failure='continue')"),
    ("pcdc model solve cycles 5 time 0.5", "sim.solve(cycles=5, time=0.5)"),
    ("pcdc model solve run-time 0.5 cycle 5", "sim.solve(run_time=0.5, cycles=5)"),
    ("pcdc model run-time 0.5", "sim.run_time(0.5)"),
    ("pcdc model solve-check 10", "sim.solve_check(10)"),
    ("pcdc model cycle-option mechanical time-step 1e-5 cycle-number 20",
     "sim.cycle_option('mechanical', time_step=1e-5, cycle_number=20)"),
    ("pcdc model cycle-option thermal time-step 1", "sim.cycle_option('thermal', time_step=1)"),
    ("pcdc model cycle-option hydraulic cycle-number 4", "sim.cycle_option('hydraulic', cycle_number=4)"),
    ("pcdc model cycle-option proppant-transport time-step 2",
     "sim.cycle_option('proppant-transport', time_step=2)"),
    ("pcdc model reset mechanical start-time 1 current-time 2 time-step 1e-5",
     "sim.reset_clock('mechanical', start_time=1, current_time=2, time_step=1e-5)"),
    ("pcdc model reset thermal current-time 2", "sim.reset_clock('thermal', current_time=2)"),
    ("pcdc model reset hydraulic time-step 2", "sim.reset_clock('hydraulic', time_step=2)"),
    ("pcdc model reset proppant-transport current-time 2", "sim.reset_clock('proppant-transport', current_time=2)"),
    ("pcdc model query mechanical time", "sim.report_time('mechanical')"),
    ("pcdc model query thermal time", "sim.report_time('thermal')"),
    ("pcdc model query hydraulic time", "sim.report_time('hydraulic')"),
    ("pcdc model query proppant-transport time", "sim.report_time('proppant-transport')"),
    ("pcdc device list", "sim.report_devices()"),
    ("pcdc model time-step table 'dt'", "sim.time_step(value='dt')"),
    ("pcdc model time-step auto on update-frequency 20", "sim.time_step(auto=True, update_frequency=20)"),
    ("pcdc table 'v' data 0 0, 1 2 type relative-time", "sim.tables.create('v', [(0, 0), (1, 2)], relative=True)"),
    ("pcdc node history 'h' thermal temperature every 3 range id 1",
     "sim.histories.create('h', 'node', 'temperature', how='mean', every=3, where='id 1')"),
    ("pcdc node thermal-initialize temperature 20", "sim.nodes.initial_temperature(20)"),
    ("pcdc node hydraulic-initialize f-n-s 0.5 range x 0 1", "sim.flow_nodes.initial(saturation=0.5, where='x 0 1')"),
    ("pcdc node hydraulic-initialize flow-node-temperature 20", "sim.flow_nodes.initial_temperature(20)"),
    ("pcdc node initial velocity-x 1 velocity-y 2", "sim.nodes.initial_velocity(vx=1, vy=2)"),
    ("pcdc node initial force-x 1 force-y 2", "sim.nodes.force(fx=1, fy=2)"),
    ("pcdc node boundary remove mech-vel-b-c mech-f-b-c mech-m-b-c hydra-c-f-b hydra-p-b therm-s-b-c therm-f-b-c",
     "sim.nodes.remove_boundary('mechanical-velocity-boundary-condition', 'mechanical-force-boundary-condition', "
     "'mechanical-move-boundary-constraint', 'hydraulic-constant-flow-boundary', 'hydraulic-proppant-boundary', "
     "'thermal-solid-boundary-condition', 'thermal-flow-boundary-condition')"),
    ("pcdc element-face boundary remove m-s-b-c therm-c-h",
     "sim.faces.remove_boundary('mechanical-stress-boundary-condition', 'thermal-const-heat')"),
    ("pcdc bolt-node boundary remove b-n-c", "sim.bolt_nodes.remove_boundary('b-n-c')"),
    ("pcdc bolt-node boundary remove b-n-f-b-c",
     "sim.bolt_nodes.remove_boundary('bolt-node-force-boundary-condition')"),
    ("pcdc element-face boundary mech-abs-b-c normal -1e5 dip 2e5 range boundary",
     "sim.faces.stress(quiet=True, normal=-1e5, dip=2e5, where='boundary')"),
    ("pcdc element-face boundary m-s-b-c dip table 'v'", "sim.faces.stress(dip='v')"),
    ("pcdc element-face list summary", "sim.faces.report()"),
    ("pcdc face-joint list summary range id 1 5", "sim.joints.report(where='id 1 5')"),
    ("pcdc model solve elastic time 1e6", "sim.solve(elastic=True, time=1e6)"),
    ("pcdc model solve elastic solver direct", "sim.solve(elastic=True, solver='direct')"),
    ("pcdc model solve elastic steps 4", "sim.solve(elastic=True, steps=4)"),
    ("pcdc model solve thermal time 5 dt 0.1", "sim.solve(thermal=True, time=5, dt=0.1)"),
    ("pcdc model solve thermal steady solver petsc", "sim.solve(thermal=True, steady=True, solver='petsc')"),
    ("pcdc model solve hydraulic time 5 dt 0.1", "sim.solve(hydraulic=True, time=5, dt=0.1)"),
    ("pcdc model solve hydraulic steady solver direct", "sim.solve(hydraulic=True, steady=True, solver='direct')"),
    ("pcdc model solve hydraulic auto time 5", "sim.solve(hydraulic=True, auto=True, time=5)"),
    ("pcdc geometry create polyline (0,0) (1,2) as-layer 'l'", "sim.geometry.polyline([(0, 0), (1, 2)], 'l')"),
    ("pcdc geometry create polygon (0,0) (4,0) (2,3) as-layer 'l'",
     "sim.geometry.polygon([(0, 0), (4, 0), (2, 3)], 'l')"),
    ("pcdc geometry create rectangle (0,0) (4,2) as-layer 'l'", "sim.geometry.rectangle((0, 0), (4, 2), 'l')"),
    ("pcdc geometry create circle (0,1) 2 as-layer 'l'", "sim.geometry.circle((0, 1), 2, 'l')"),
    ("pcdc geometry create arc (0,1) 2 0 90 as-layer 'l'", "sim.geometry.arc((0, 1), 2, 0, 90, as_layer='l')"),
    ("pcdc geometry create point (1,1) (2,2) as-layer 'l'", "sim.geometry.point(np.array([[1, 1], [2, 2]]), 'l')"),
    ("pcdc geometry create fractures orientation fisher 30 spread 20 length exponential 2 p21 1.5 inside 'out' seed 7 "
     "as-layer 's'",
     "sim.geometry.fractures('s', 'out', orientation=('fisher', 30), orientation_spread=20, length=('exponential', 2), "
     "p21=1.5, seed=7)"),
    ("pcdc geometry create fractures orientation normal 3 length lognormal 2 spread 1 least 0.5 great 9 p10 2 "
     "scan-line 45 ends-at 0.5 hole 'h' hole 'i' shortest 0.1 inside 'out' seed 7 as-layer 's'",
     "sim.geometry.fractures('s', 'out', orientation=('normal', 3), length=('lognormal', 2), length_spread=1, "
     "length_least=0.5, length_greatest=9, p10=2, scan_line=45, ends_at=0.5, hole=['h', 'i'], "
     "shortest=0.1, seed=7)"),
    ("pcdc geometry create fractures orientation fixed 3 length fixed 2 p20 2 reached inside 'out' seed 7 as-layer "
     "'s'",
     "sim.geometry.fractures('s', 'out', orientation=('fixed', 3), length=('fixed', 2), p20=2, reached=True, "
     "seed=7)"),
    ("pcdc geometry import 'a.dxf' as-layer 'l' dxf-layer 'k' scale 0.001",
     "sim.geometry.import_file(Path('a.dxf'), 'l', dxf_layer='k', scale=0.001)"),
    ("pcdc geometry import 'a.geojson' as-layer 'l' named origin (1,0) to (0,2) line (0,0) (1,1) legend 'k.csv' "
     "attribute 'unit' simplify 2",
     "sim.geometry.import_file('a.geojson', 'l', named=True, origin=(1, 0), to=(0, 2), line=((0, 0), (1, 1)), "
     "legend='k.csv', attribute='unit', simplify=2)"),
    ("pcdc geometry transform 'l' scale 2 rotate 30 about (0,1) move (1,0)",
     "sim.geometry.transform('l', scale=2, rotate=30, about=(0, 1), move=(1, 0))"),
    ("pcdc geometry delete 'l' 'm'", "sim.geometry.delete('l', 'm')"),
    ("pcdc geometry create circle c (0,1) rad 2 s-l 0.5 as-layer 'l'",
     "sim.geometry.circle((0, 1), 2, 'l', segment_length=0.5)"),
    ("pcdc geometry scale (2,1) layer 'l' 'm'", "sim.geometry.scale((2, 1), ['l', 'm'])"),
    ("pcdc geometry translate (2,1) layer 'l'", "sim.geometry.translate((2, 1), ['l'])"),
    ("pcdc geometry export 'l' 'm' file 'a.dxf'", "sim.geometry.export(['l', 'm'], 'a.dxf')"),
    ("pcdc geometry export 'l' file 'a.csv' scale 2 origin (1,0) to (0,2) line (0,0) (1,1)",
     "sim.geometry.export(['l'], 'a.csv', scale=2, origin=(1, 0), to=(0, 2), line=((0, 0), (1, 1)))"),
    ("pcdc mesh create from-layer 'o' size 0.5 type quad refine-layer 'h' size 0.05 refine-layer 'i' size 0.1 distance "
     "2 hole 'h' region 'r' region 'q' group 'w' embed 'e' crack 'c' irregular smooth group 'rock' set 'd'",
     "sim.mesh.create('o', 0.5, 'quad', refine_layer=[('h', 0.05), ('i', 0.1, 2)], hole=['h'], region=['r', ('q', 'w')]"
     ", embed=['e'], crack=['c'], irregular=True, smooth=True, group='rock', set='d')"),
    ("pcdc mesh structured (0,0) (4,2) cells 4 2 type quad diagonal both ratio 1.5 1 group 'rock' set 'd'",
     "sim.mesh.structured((0, 0), (4, 2), (4, 2), 'quad', 'both', ratio=(1.5, 1), group='rock', set='d')"),
    ("pcdc mesh structured (0,0) (4,2) cells 4 2", "sim.mesh.structured((0, 0), (4, 2), (4, 2))"),
    ("pcdc mesh equilateral (0,0) (4,2) size 0.5 group 'rock'",
     "sim.mesh.equilateral((0, 0), (4, 2), 0.5, group='rock')"),
    ("pcdc mesh import 'a.msh' group 'rock' set 'd' merge 1e-3 scale 0.5",
     "sim.mesh.import_file('a.msh', group='rock', set='d', merge=1e-3, scale=0.5)"),
    ("pcdc mesh intersect layer 'l' follow", "sim.mesh.intersect('l', follow=True)"),
    ("pcdc mesh glue tolerance 1e-3 between 'a' 'b' set 'd'", "sim.mesh.glue(1e-3, ('a', 'b'), set='d')"),
    ("pcdc mesh quadratic", "sim.mesh.quadratic()"),
    ("pcdc mesh quality", "sim.mesh.quality()"),
    ("pcdc node mechanical-damp local 0.5 range x 0 1", "sim.nodes.damp(0.5, where='x 0 1')"),
    ("pcdc element-face boundary m-s-b-c dip 1e5 range x 0 1", "sim.faces.stress(dip=1e5, where='x 0 1')"),
    ("pcdc bolt-element create (0,1) (0,2) m-s 0.1 group 'a' set 's' range x 0 1",
     "sim.bolts.between((0, 1), (0, 2), 0.1, group='a', set='s', where='x 0 1')"),
    *((f"pcdc element c-model {model}", f"sim.elements.model('{name}', {given})") for model, name, given in (
        ("hydr-p-m f-den 1000 f-bulk 2e9 visc 1e-6 a-i 1e-4 a-min 1e-5 a-max 1e-3", "hydr-p-m",
         "fluid_density=1000, fluid_bulk=2e9, viscosity=1e-6, aperature_initial=1e-4, aperature_minumum=1e-5, "
         "aperature_maximum=1e-3"),
        ("hydr-p-p-m f-den 1000 f-bulk 2e9 visc 1e-6 a-i 1e-4 a-min 1e-5 a-max 1e-3 p-den 2600 p-s 1e-4 "
         "p-c-l 0.6", "hydr-p-p-m",
         "fluid_density=1000, fluid_bulk=2e9, viscosity=1e-6, aperature_initial=1e-4, aperature_minumum=1e-5, "
         "aperature_maximum=1e-3, proppant_density=2600, proppant_size=1e-4, "
         "proppant_concentration_limit=0.6"),
        ("t-f con 0.6 cap 4200", "t-f", "conductivity=0.6, capacity=4200"))),
    ("pcdc element glue range x 0 1", "sim.mesh.glue(where='x 0 1')"),
    ("pcdc element densify pattern 1 0 max-length 0.5 0.2 range x 0 1",
     "sim.mesh.densify((0.5, 0.2), (1, 0), where='x 0 1')"),
    ("pcdc element densify max-length 0.5", "sim.mesh.densify(0.5)"),
    ("pcdc element delete range x 0 1", "sim.mesh.delete(where='x 0 1')"),
    ("pcdc model add node (0,0) (1,2)", "sim.mesh.add_nodes([(0, 0), (1, 2)])"),
    ("pcdc model add element 0 1 2", "sim.mesh.add_element(0, 1, 2)"),
    ("pcdc model scale (1,2)", "sim.mesh.scale((1, 2))"),
    ("pcdc model translate (1,2)", "sim.mesh.translate((1, 2))"),
    ("pcdc element hide range x 0 1", "sim.elements.hide(where='x 0 1')"),
    ("pcdc element hide off range x 0 1 use-hidden on", "sim.elements.hide(False, where='x 0 1 use-hidden on')"),
    ("pcdc element collision off range x 0 1", "sim.elements.collision(False, where='x 0 1')"),
    ("pcdc element water surface 'l' density 1000 range x 0 1", "sim.elements.water('l', 1000, where='x 0 1')"),
    ("pcdc element list summary range x 0 1", "sim.elements.report(where='x 0 1')"),
    ("pcdc element create brick p0 (0,0) p1 (2,0) p2 (1,1) n 4 2 ratio 1 2 triangle off group 'a' set 'd'",
     "sim.mesh.brick((0, 0), (2, 0), (1, 1), n=(4, 2), ratio=(1, 2), triangle=False, group='a', set='d')"),
    ("pcdc element create geometry layer 'a' 'b' m-s 1 is-b circle c (0,0) r 1 m-s 0.5 arc c (0,0) s-p (1,0) e-p (0,1) "
     "group 'a'",
     "sim.mesh.geometry(layer=[(['a', 'b'], 1, True)], circle=[((0, 0), 1, 0.5)], arc=[((0, 0), (1, 0), (0, 1))], "
     "group='a')"),
    ("pcdc element create geometry-patch b-c-p layer 'a' m-s 1 c-polyline array (0,0) (1,1) c-point array (2,2) m-s "
     "0.2 g-m-s 2 tolerance 1e-3 group 'a'",
     "sim.mesh.patch([{'layer': ['a'], 'mesh_size': 1}], polyline=[{'array': [(0, 0), (1, 1)]}], "
     "point=[{'array': [(2, 2)], 'mesh_size': 0.2}], global_mesh_size=2, tolerance=1e-3, group='a')"),
    ("pcdc element create geometry-boundary boundary (0,0) (2,0) (0,2) m-s 1 inner-boundary (0.1,0.1) (0.5,0.1) "
     "(0.1,0.5) m-s 0.1 filled on group 'a'",
     "sim.mesh.boundary([(0, 0), (2, 0), (0, 2)], 1, inner=[([(0.1, 0.1), (0.5, 0.1), (0.1, 0.5)], 0.1, True)], "
     "group='a')"),
    ("pcdc element create hollow-circle c (0,0) r 4 m-s 0.8 i-r 1 m-s 0.2 group 'a'",
     "sim.mesh.hollow_circle((0, 0), 4, 1, 0.8, 0.2, group='a')"),
    ("pcdc element group 'a' set 's' range x 0 1 present", "sim.elements.group('a', 's', where='x 0 1 present')"),
    ("pcdc element c-model mech-m-c property density 2500 young 50e9 poisson-ratio 0.25 friction 30 cohesion 1e6 "
     "tensile 1e5 dilation 5",
     "sim.elements.model('mech-m-c', density=2500, young=50e9, poisson_ratio=0.25, friction=30, cohesion=1e6, "
     "tensile=1e5, dilation=5)"),
    ("pcdc element c-model mech-iso-elastic property density 2500 young 50e9 poisson-ratio 0.25 range group 'a' set "
     "'d'",
     "sim.elements.model('mech-iso-elastic', density=2500, young=50e9, poisson_ratio=0.25, where=g.InGroup('a', 'd'))"),
    ("pcdc element c-model null relax 0.5 range id 3 5", "sim.elements.null(relax=0.5, where=g.Ids(3, 5))"),
    ("pcdc element property young table 'E' over y density field 'rho' range geometry 'hole'",
     "sim.elements.property(young=sim.tables.over('E', 'y'), density=sim.fields.drawn('rho'), "
     "where=\"geometry 'hole'\")"),
    ("pcdc element property cohesion table 'c' over plastic-strain",
     "sim.elements.property(cohesion=sim.tables.over('c', 'plastic-strain'))"),
    ("pcdc face-joint property tensile-strength table 'c' over temperature",
     "sim.joints.property(tensile_strength=sim.tables.over('c', 'temperature'))"),
    ("pcdc element initial stress-xx -5e6 stress-yy 0 gradient (0,25e3) range x 0 2 y 1 3",
     "sim.elements.initial_stress(xx=-5e6, yy=0, gradient={'yy': (0, 25e3)}, "
     "where=(g.Span(0, 0.0, 2.0), g.Span(1, 1.0, 3.0)))"),
    ("pcdc element c-model user 'a.py:clay' property density 2500 young 50e9 poisson-ratio 0.25 parameter 'limit' 2e6 "
     "parameter 'slope' field 'rho' range x 0 1",
     "sim.elements.model('user', law='a.py:clay', density=2500, young=50e9, poisson_ratio=0.25, "
     "parameter=[('limit', 2e6), ('slope', sim.fields.drawn('rho'))], where='x 0 1')"),
    ("pcdc element property parameter 'limit' 3e6", "sim.elements.property(parameter=[('limit', 3e6)])"),
    ("pcdc element law 'a.py:clay'", "sim.elements.law('a.py:clay')"),
    ("pcdc element initial stress-xy 1 stress-zz 2", "sim.elements.initial_stress(xy=1, zz=2)"),
    ("pcdc element c-model mech-burgers property density 2500 bulk 20e9 maxwell-shear 10e9 maxwell-viscosity 1e16 "
     "kelvin-shear 5e9 kelvin-viscosity 1e14",
     "sim.elements.model('mech-burgers', density=2500, bulk=20e9, maxwell_shear=10e9, maxwell_viscosity=1e16, "
     "kelvin_shear=5e9, kelvin_viscosity=1e14)"),
    ("pcdc element reset kelvin-strain range id 1 2",
     "sim.elements.reset_kelvin_strain(where=g.Ids(1, 2))"),
    ("pcdc element reset state range set 'd'", "sim.elements.reset_state(where=g.InSet('d'))"),
    ("pcdc element-face group 'a' set 's' range boundary", "sim.faces.group('a', 's', where='boundary')"),
    ("pcdc element-face c-model contact-m-c property friction 30", "sim.faces.model('contact-m-c', friction=30)"),
    ("pcdc element-face property friction 20 range geometry 'l'",
     "sim.faces.property(friction=20, where=g.OnLayer('l'))"),
    ("pcdc element-face boundary m-s-b-c s-xx 1 s-yy 2 s-n table 'blast' quiet on range face-of 'a' set 'd'",
     "sim.faces.stress(xx=1, yy=2, normal='blast', quiet=True, where=g.OfElements('a', 'd'))"),
    ("pcdc element-face boundary m-s-b-c quiet on inc-x table 'blast' inc-y 0.5 range boundary y 0 0",
     "sim.faces.stress(quiet=True, incoming_x='blast', incoming_y=0.5, where=(g.OnBoundary(), g.Span(1, 0.0, 0.0)))"),
    ("pcdc element-face boundary free-field range boundary x 0 0",
     "sim.faces.free_field(where=(g.OnBoundary(), g.Span(0, 0.0, 0.0)))"),
    ("pcdc element-face boundary remove range boundary", "sim.faces.remove_boundary(where=g.OnBoundary())"),
    ("pcdc face-joint group 'a' set 's'", "sim.joints.group('a', 's')"),
    ("pcdc face-joint c-model c-i-c-i property friction 30 cohesion 10e6 tensile-strength 2e6 gf1 20 gf2 200 np 3",
     "sim.joints.model('c-i-c-i', friction=30, cohesion=10e6, tensile_strength=2e6, gf1=20, gf2=200, np=3)"),
    ("pcdc face-joint c-model j-m-c property n-s 1e10 s-s 4e9 friction 30 dilation 5 range crack",
     "sim.joints.model('j-m-c', normal_stiffness=1e10, shear_stiffness=4e9, friction=30, dilation=5, where='crack')"),
    ("pcdc face-joint c-model j-b-b property normal-stiffness 1e10 s-s 4e9 c-m 2e-4 r-f 28 jrc 8 jcs 5e7",
     "sim.joints.model('joint-barton-bandis', normal_stiffness=1e10, shear_stiffness=4e9, closure_maximum=2e-4, "
     "residual_friction=28, jrc=8, jcs=5e7)"),
    ("pcdc face-joint property tensile-strength 1e6 penalty-overlap 1e12 range between 'a' 'b' set 'd'",
     "sim.joints.property(tensile_strength=1e6, penalty_overlap=1e12, where=\"between 'a' 'b' set 'd'\")"),
    ("pcdc face-joint reset state range crack", "sim.joints.reset_state(where=g.OnCrack())"),
    ("pcdc node group 'top' set 'bc' range y 2 2", "sim.nodes.group('top', 'bc', where='y 2 2')"),
    ("pcdc node boundary mech-vel-b-c velocity-x 1 velocity-y table 'v' range id 1",
     "sim.nodes.velocity(vx=1, vy='v', where='id 1')"),
    ("pcdc node boundary mech-vel-b-c acceleration-x 1 acceleration-y -1", "sim.nodes.velocity(ax=1, ay=-1)"),
    ("pcdc node boundary mech-f-b-c force-x 1 force-y table 'v'", "sim.nodes.force(fx=1, fy='v')"),
    ("pcdc node boundary mech-vel-b-c velocity-x function 'a.py:wave' range id 1",
     "sim.nodes.velocity(vx=FunctionName('a.py:wave'), where='id 1')"),
    ("pcdc node function 'a.py:wave'", "sim.nodes.function('a.py:wave')"),
    ("pcdc node boundary mech-m-b-c type 2 (1,1) range id 2", "sim.nodes.move(2, (1, 1), where='id 2')"),
    ("pcdc node boundary mech-m-b-c type 1", "sim.nodes.move(1)"),
    ("pcdc node boundary remove range id 0", "sim.nodes.remove_boundary(where='id 0')"),
    ("pcdc element c-model therm-iso-h conductivity 2.5 capacity 900 expansion-coefficient 1e-5 range group 'g'",
     "sim.elements.model('therm-iso-h', conductivity=2.5, capacity=900, expansion_coefficient=1e-5, "
     "where=\"group 'g'\")"),
    ("pcdc element c-model moisture-diffusion diffusivity 1e-8 shrinkage 0.1 evaporation 1e-6 moisture-saturated 0.4 "
     "moisture-residual 0.1 air-entry 2e4 pore-index 2 range group 'g'",
     "sim.elements.model('moisture-diffusion', diffusivity=1e-8, shrinkage=0.1, evaporation=1e-6, "
     "moisture_saturated=0.4, moisture_residual=0.1, air_entry=2e4, pore_index=2, where=\"group 'g'\")"),
    ("pcdc node boundary moisture-boundary-condition moisture table 'v' range id 1",
     "sim.nodes.field('moisture', 'v', where='id 1')"),
    ("pcdc element-face boundary moisture-flux-boundary-condition flux 1 transfer 2 environment 0.1",
     "sim.faces.field('moisture', flux=1, transfer=2, environment=0.1)"),
    ("pcdc node initial moisture 0.3 range id 7", "sim.nodes.initial_field('moisture', 0.3, where='id 7')"),
    ("pcdc model field moisture flows off time-step 60 sub-steps 2 current-time 5",
     "sim.field_clock('moisture', flows=False, time_step=60, sub_steps=2, current_time=5)"),
    ("pcdc node boundary remove moisture-boundary-condition",
     "sim.nodes.remove_boundary('moisture-boundary-condition')"),
    ("pcdc element-face boundary remove moisture-flux-boundary-condition",
     "sim.faces.remove_boundary('moisture-flux-boundary-condition')"),
    ("pcdc element property cohesion table 'c' over moisture",
     "sim.elements.property(cohesion=sim.tables.over('c', 'moisture'))"),
    ("pcdc node boundary therm-s-b-c temperature table 'v' range id 1",
     "sim.nodes.temperature('v', where='id 1')"),
    ("pcdc node boundary therm-f-b-c temperature 7 range id 1", "sim.nodes.fluid_temperature(7, where='id 1')"),
    ("pcdc element-face boundary therm-c-h heat-flux table 'v' transfer-coeficient 5 environment-temperature 10",
     "sim.faces.heat(heat_flux='v', transfer_coeficient=5, environment_temperature=10)"),
    ("pcdc node initial temperature 20 range id 7", "sim.nodes.initial_temperature(20, where='id 7')"),
    ("pcdc node initial velocity (3,4) range id 7", "sim.nodes.initial_velocity((3, 4), where='id 7')"),
    ("pcdc node reset velocity", "sim.nodes.reset_velocity()"),
    ("pcdc node reset displacement", "sim.nodes.reset_displacement()"),
    ("pcdc face-joint c-model hydr-p-m property f-den 1000 f-bulk 2e9 vis 1e-6 a-initial 1e-5 a-min 1e-6 range crack",
     "sim.joints.model('hydr-p-m', fluid_density=1000, fluid_bulk=2e9, viscosity=1e-6, aperture_initial=1e-5, "
     "aperture_minimum=1e-6, where='crack')"),
    ("pcdc face-joint c-model t-f property con 0.6 cap 4200 t-c 100 second-order on range crack",
     "sim.joints.model('t-f', conductivity=0.6, capacity=4200, transfer_coeficient=100, second_order=True, "
     "where='crack')"),
    ("pcdc face-joint c-model hydr-p-p-m property f-den 1000 f-bulk 2e9 vis 1e-6 a-initial 1e-2 a-min 1e-3 p-den 2650 "
     "p-s 5e-4 p-c-l 0.6 p-sto on range crack",
     "sim.joints.model('hydr-p-p-m', fluid_density=1000, fluid_bulk=2e9, viscosity=1e-6, aperature_initial=1e-2, "
     "aperature_minumum=1e-3, proppant_density=2650, proppant_size=5e-4, proppant_concentration_limit=0.6, "
     "proppant_stokes=True, where='crack')"),
    ("pcdc node boundary hydra-c-f-b pressure table 'v' range id 1", "sim.nodes.fluid(pressure='v', where='id 1')"),
    ("pcdc node boundary hydra-c-f-b flow-surface 2", "sim.nodes.fluid(flow_surface=2)"),
    ("pcdc node boundary hydra-p-b p-v-c table 'v' range id 1",
     "sim.nodes.proppant(proppant_volumetric_concentration='v', where='id 1')"),
    ("pcdc node boundary hydra-p-b p-v-f-r 2", "sim.nodes.proppant(proppant_volumetric_flow_rate=2)"),
    ("pcdc node boundary hydra-c-f-b flow-rate 2", "sim.nodes.fluid(flow_rate=2)"),
    ("pcdc flow-node initial saturation 1 range x 0 1", "sim.flow_nodes.initial(saturation=1, where='x 0 1')"),
    ("pcdc flow-node initial concentration 0.1", "sim.flow_nodes.initial(concentration=0.1)"),
    ("pcdc flow-node initial pressure 1e6", "sim.flow_nodes.initial(pressure=1e6)"),
    ("pcdc well create 'w' range geometry 'l'", "sim.wells.create('w', where=g.OnLayer('l'))"),
    ("pcdc well stage 'w' rate 1e-4 time 60 limit 8e6", "sim.wells.stage('w', rate=1e-4, time=60, limit=8e6)"),
    ("pcdc well stage 'w' rate table 'v'", "sim.wells.stage('w', rate='v')"),
    ("pcdc well stage 'w' pressure 2e6", "sim.wells.stage('w', pressure=2e6)"),
    ("pcdc well stage 'w' shut-in time 5", "sim.wells.stage('w', shut_in=True, time=5)"),
    ("pcdc history create 'h' well value injected well 'w' every 3",
     "sim.histories.create('h', 'well', 'injected', well='w', every=3)"),
    ("pcdc face-joint property a-initial field 'f' shear-dilation 5 shear-dilation-limit 1e-4 range crack",
     "sim.joints.property(aperture_initial=sim.fields.drawn('f'), shear_dilation=5, shear_dilation_limit=1e-4, "
     "where='crack')"),
    ("pcdc history create 'h' flow-channel value aperture max range crack",
     "sim.histories.create('h', 'flow-channel', 'aperture', how='maximum', where='crack')"),
    ("pcdc history create 'h' flow-node nearest (5,0) value pressure",
     "sim.histories.create('h', 'flow-node', 'pressure', nearest=(5, 0))"),
    ("pcdc bolt create polyline (0,0) (1,2) (1,3) segments 4 grout 0.5 2 plate group 'a' set 's'",
     "sim.bolts.create([(0, 0), (1, 2), (1, 3)], segments=4, grout=(0.5, 2), plate=True, group='a', set='s')"),
    ("pcdc bolt create polyline (0,0) (1,2) length 0.1", "sim.bolts.create([(0, 0), (1, 2)], length=0.1)"),
    ("pcdc bolt c-model mech-e-p property density 7850 young 200e9 diameter 0.025 s-s-r-b 1e9 g-t 0.01 c-r-g 1e6 "
     "c-g-b 2e6 spac 1.5 range group 'a' set 's'",
     "sim.bolts.model('mech-e-p', density=7850, young=200e9, diameter=0.025, shear_stiffness_rock_bolt=1e9, "
     "grout_thickness=0.01, cohesion_rock_grout=1e6, cohesion_grout_bolt=2e6, spacing=1.5, "
     "where=\"group 'a' set 's'\")"),
    ("pcdc bolt-element group 'a' set 's' range id 3", "sim.bolts.group('a', 's', where='id 3')"),
    ("pcdc bolt-node group 'a' set 's' range y 0 1 present",
     "sim.bolt_nodes.group('a', 's', where='y 0 1 present')"),
    ("pcdc bolt-node boundary b-n-c velocity-x 1 velocity-y table 'v' range id 1",
     "sim.bolt_nodes.velocity(vx=1, vy='v', where='id 1')"),
    ("pcdc bolt-node boundary b-n-c acceleration-x 1 acceleration-y -1", "sim.bolt_nodes.velocity(ax=1, ay=-1)"),
    ("pcdc bolt-node boundary b-n-f-b-c force-x 1 force-y table 'v'", "sim.bolt_nodes.force(fx=1, fy='v')"),
    ("pcdc bolt-node boundary remove range id 0", "sim.bolt_nodes.remove_boundary(where='id 0')"),
    ("pcdc bolt delete range group 'a' set 's'", "sim.bolts.delete(where=\"group 'a' set 's'\")"),
    ("pcdc liner create group 'a' set 's' range boundary y 2 2",
     "sim.liners.create(group='a', set='s', where='boundary y 2 2')"),
    ("pcdc liner c-model beam property density 2400 young 20e9 thickness 0.2 n-s 1e10 s-s 1e10 b-t-s 1e6 "
     "range group 'a'",
     "sim.liners.model('beam', density=2400, young=20e9, thickness=0.2, normal_stiffness=1e10, shear_stiffness=1e10, "
     "bond_tensile_strength=1e6, where=\"group 'a'\")"),
    ("pcdc liner delete", "sim.liners.delete()"),
    ("pcdc liner-element group 'a' set 's' range id 3", "sim.liners.group('a', 's', where='id 3')"),
    ("pcdc liner-node group 'a' set 's' range y 0 1 present",
     "sim.liner_nodes.group('a', 's', where='y 0 1 present')"),
    ("pcdc liner-node boundary l-n-c velocity-x 1 velocity-y table 'v' spin 0 range id 1",
     "sim.liner_nodes.velocity(vx=1, vy='v', spin=0, where='id 1')"),
    ("pcdc liner-node boundary l-n-f-b-c force-x 1 force-y table 'v' moment 2",
     "sim.liner_nodes.force(fx=1, fy='v', moment=2)"),
    ("pcdc liner-node boundary remove range id 0", "sim.liner_nodes.remove_boundary(where='id 0')"),
    ("pcdc history create 'h' bolt-element value axial-force max range group 'a'",
     "sim.histories.create('h', 'bolt-element', 'axial-force', how='maximum', where=\"group 'a'\")"),
    ("pcdc history create 'h' bolt-node nearest (5,0) value slip",
     "sim.histories.create('h', 'bolt-node', 'slip', nearest=(5, 0))"),
    ("pcdc table create 'v' values (0,0) (1,2)", "sim.tables.create('v', [(0, 0), (1, 2)])"),
    ("pcdc table delete 'v'", "sim.tables.delete('v')"),
    ("pcdc field create 'f' weibull 5e6 4 seed 7 correlation 0.02 covariance gaussian least 1e6 greatest 9e6",
     "sim.fields.create('f', weibull=(5e6, 4), seed=7, correlation=0.02, covariance='gaussian', least=1e6, "
     "greatest=9e6)"),
    ("pcdc field create 'f' normal 5 1 seed 7", "sim.fields.create('f', normal=(5, 1), seed=7)"),
    ("pcdc field create 'f' lognormal 5 1 seed 7", "sim.fields.create('f', lognormal=(5, 1), seed=7)"),
    ("pcdc field delete 'f'", "sim.fields.delete('f')"),
    ("pcdc history create 'h' node value reaction-y sum every 100 range group 'p' set 'bc'",
     "sim.histories.create('h', 'node', 'reaction-y', how='sum', every=100, where=\"group 'p' set 'bc'\")"),
    ("pcdc history create 'h' joint value normal-stress-largest max range crack",
     "sim.histories.create('h', 'joint', 'normal_stress_largest', how='maximum', where='crack')"),
    ("pcdc history create 'h' element id 3 value law-state variable 'slip'",
     "sim.histories.create('h', 'element', 'law-state', variable='slip', id=3)"),
    ("pcdc history create 'h' element value stress-yy min",
     "sim.histories.create('h', 'element', 'stress-yy', how='minimum')"),
    ("pcdc history create 'h' node value velocity-x mean",
     "sim.histories.create('h', 'node', 'velocity-x', how='mean')"),
    ("pcdc history create 'h' element nearest (5,0) value stress-yy",
     "sim.histories.create('h', 'element', 'stress-yy', nearest=(5, 0))"),
    ("pcdc history create 'h' element id 3 value stress-yy", "sim.histories.create('h', 'element', 'stress-yy', id=3)"),
    ("pcdc history create 'h' model value broken-joints", "sim.histories.create('h', 'model', 'broken-joints')"),
    ("pcdc history delete 'h'", "sim.histories.delete('h')"),
    ("pcdc history export 'h.csv' names 'a' 'b'", "sim.histories.export('h.csv', ['a', 'b'])"),
    ("pcdc chart create 'c' title 't' x-label 'x' y-label 'y'",
     "sim.charts.create('c', title='t', x_label='x', y_label='y')"),
    ("pcdc chart add 'c' x 'a' scale-x 2 y 'b' scale-y 3 label 'l'",
     "sim.charts.add('c', x='a', scale_x=2, y='b', scale_y=3, label='l')"),
    ("pcdc chart add 'c' values (0,0) (1,1) style points",
     "sim.charts.add('c', values=[(0, 0), (1, 1)], style='points')"),
    ("pcdc chart export 'c' 'c.png' cracks", "sim.charts.export('c', 'c.png', cracks=True)"),
    ("pcdc chart add 'c' profile flow-rate scale-y 1e3 label 'q' range crack",
     "sim.charts.add('c', profile='flow_rate', scale_y=1e3, label='q', where='crack')"),
    ("pcdc chart export 'c' 'c.png' temperature", "sim.charts.export('c', 'c.png', temperature=True)"),
    ("pcdc chart export 'c' 'c.png' fluid velocity", "sim.charts.export('c', 'c.png', fluid='velocity')"),
    ("pcdc chart export 'c' 'c.png' plastic", "sim.charts.export('c', 'c.png', plastic=True)"),
    ("pcdc output vtk 'f' every 10", "sim.output.vtk('f', every=10)"),
    ("pcdc output vtk 'f'", "sim.output.vtk('f')"),
    ("pcdc output vtk 'f' off", "sim.output.vtk('f', off=True)"),
    ("pcdc output image 'f'", "sim.output.image('f')"),
    ("pcdc output image 'f' view 'a.mv' field 'stress-yy' limits -1 2 log colours cividis opacity 0.5 edges size 2 "
     "vectors 'velocity' arrows 3 filter 'x > 1' deformed 10 camera (0,0) (1,2) title 'a'",
     "sim.output.image('f', view='a.mv', field='stress-yy', limits=(-1, 2), log=True, colours='cividis', opacity=0.5, "
     "edges=True, size=2, vectors='velocity', arrows=3, filter='x > 1', deformed=10, camera=((0, 0), (1, 2)), "
     "title='a')"),
    ("pcdc output image 'f' field 'stress-yy' full", "sim.output.image('f', field='stress-yy', full=True)"),
    ("pcdc output image 'f' object elements range id 0 3", "sim.output.image('f', object='elements', where='id 0 3')"),
]  # fmt: skip
"""A line of a script, and the line of a program that does the same."""


class Recorder:
    """Stands for hpcdem.commands.fdem: notes every call with the arguments that the function gets, and its defaults."""

    def __init__(self) -> None:
        self.calls: list[tuple[str, dict[str, Any]]] = []

    def __getattr__(self, module: str) -> Any:
        real = importlib.import_module(f"hpcdem.commands.fdem.{module}")

        def function(name: str) -> Any:
            def call(*values: Any, **named: Any) -> dict[str, Any]:
                bound = inspect.signature(getattr(real, name)).bind(*values, **named)
                bound.apply_defaults()
                self.calls.append((f"{module}.{name}", {k: v for k, v in bound.arguments.items() if k != "project"}))
                return {}

            return call

        return SimpleNamespace(**{name: function(name) for name, _ in inspect.getmembers(real, inspect.isfunction)})


def program(bench: Bench) -> Simulation:
    """A simulation whose blocks are those of the bench, without particles."""
    sim = Simulation.__new__(Simulation)
    sim._session = SimpleNamespace(interpreter=None, comm=SerialComm())
    sim._engine, sim._project, sim._log, sim.directory = None, bench.project, None, bench.project.directory
    sim._begin_blocks(lambda: bench.project)
    return sim


def carry_out(sim: Simulation, text: str) -> Any:
    return eval(
        compile(text, "study.py", "eval"), {"sim": sim, "g": g, "np": np, "Path": Path, "FunctionName": FunctionName}
    )


IN_SPACE: list[tuple[str, str]] = [
    ("pcdc liner-node boundary l-n-c velocity-z 0 spin-x 1 spin-y 0 spin-z table 'v' range id 1",
     "sim.liner_nodes.velocity(vz=0, spin_x=1, spin_y=0, spin_z='v', where='id 1')"),
    ("pcdc liner-node boundary l-n-f-b-c force-z 1 moment-x 2 moment-y 3 moment-z 4",
     "sim.liner_nodes.force(fz=1, moment_x=2, moment_y=3, moment_z=4)"),
    ("pcdc geometry create circle c (0,1,0) rad 2 normal (1,0,0) as-layer 'l'",
     "sim.geometry.circle((0, 1, 0), 2, 'l', normal=(1, 0, 0))"),
    ("pcdc element create brick p0 (0,0,0) p1 (2,0,0) p2 (1,1,0) p3 (0,0,2) n 4 2 2",
     "sim.mesh.brick((0, 0, 0), (2, 0, 0), (1, 1, 0), (0, 0, 2), n=(4, 2, 2))"),
    ("pcdc model option potential munjiza overlap keep deep-overlap stop",
     "sim.option(potential='munjiza', overlap='keep', deep_overlap='stop')"),
    ("pcdc element-face c-model contact-m-c property p-n 1e9 friction 30 range boundary",
     "sim.faces.model('contact-m-c', penalty_normal=1e9, friction=30, where='boundary')"),
    ("pcdc model gravity (0,1,-9.81)", "sim.gravity((0, 1, -9.81))"),
    ("pcdc geometry create box (0,0,0) (1,2,3) as-layer 'l'", "sim.geometry.box((0, 0, 0), (1, 2, 3), 'l')"),
    ("pcdc geometry create sphere (0,1,2) 3 as-layer 'l'", "sim.geometry.sphere((0, 1, 2), 3, 'l')"),
    ("pcdc geometry create cylinder (0,0,0) (0,0,1) 2 as-layer 'l'",
     "sim.geometry.cylinder((0, 0, 0), (0, 0, 1), 2, 'l')"),
    ("pcdc geometry create cone (0,0,0) (0,0,1) 2 1 as-layer 'l'",
     "sim.geometry.cone((0, 0, 0), (0, 0, 1), 2, 1, 'l')"),
    ("pcdc geometry create disc (0,0,0) (0,0,1) 2 as-layer 'l'", "sim.geometry.disc((0, 0, 0), (0, 0, 1), 2, 'l')"),
    ("pcdc geometry create plane (0,0,0) (0,0,1) as-layer 'l'", "sim.geometry.plane((0, 0, 0), (0, 0, 1), 'l')"),
    ("pcdc geometry create extrude layer 'p' along (0,0,1) as-layer 'l'",
     "sim.geometry.extrude('p', (0, 0, 1), 'l')"),
    ("pcdc geometry create revolve layer 'p' axis (0,0,1) about (1,0,0) angle 90 as-layer 'l'",
     "sim.geometry.revolve('p', (0, 0, 1), 'l', about=(1, 0, 0), angle=90)"),
    ("pcdc geometry create fractures orientation fisher 30 spread 9 towards 45 radius power 2.5 least 1 greatest 9 "
     "p32 1 inside 'o' seed 7 as-layer 'l'",
     "sim.geometry.fractures('l', 'o', orientation=('fisher', 30), orientation_spread=9, orientation_towards=45, "
     "radius=('power', 2.5), radius_least=1, radius_greatest=9, p32=1, seed=7)"),
    ("pcdc geometry create fractures orientation fixed 30 radius lognormal 2 spread 1 p10 1 scan-direction (1,0,0) "
     "inside 'o' seed 7 as-layer 'l'",
     "sim.geometry.fractures('l', 'o', orientation=('fixed', 30), radius=('lognormal', 2), radius_spread=1, p10=1, "
     "scan_direction=(1, 0, 0), seed=7)"),
    ("pcdc geometry create fractures orientation fixed 30 radius fixed 2 p30 1 inside 'o' seed 7 reached as-layer 'l'",
     "sim.geometry.fractures('l', 'o', orientation=('fixed', 30), radius=('fixed', 2), p30=1, seed=7, reached=True)"),
    ("pcdc mesh create from-layer 'l' size 1 crack 'a' embed 'b' bodies",
     "sim.mesh.create('l', 1, crack=['a'], embed=['b'], bodies=True)"),
    ("pcdc mesh structured (0,0,0) (4,2,1) cells 4 2 1 split 12 ratio 1.5 1 2 group 'rock' set 'd'",
     "sim.mesh.structured((0, 0, 0), (4, 2, 1), (4, 2, 1), split=12, ratio=(1.5, 1, 2), group='rock', set='d')"),
    ("pcdc mesh create from-layer 'o' size 0.5 hole 'h'", "sim.mesh.create('o', 0.5, hole=['h'])"),
    ("pcdc node boundary mech-vel-b-c velocity-z 1 acceleration-x 2", "sim.nodes.velocity(vz=1, ax=2)"),
    ("pcdc element-face boundary m-s-b-c quiet on incoming-z table 'v'",
     "sim.faces.stress(quiet=True, incoming_z='v')"),
    ("pcdc bolt create polyline (0,0,0) (1,2,3) segments 2", "sim.bolts.create([(0, 0, 0), (1, 2, 3)], segments=2)"),
    ("pcdc bolt-node boundary b-n-c velocity-z 1 velocity-x 2", "sim.bolt_nodes.velocity(vz=1, vx=2)"),
    ("pcdc bolt-node boundary b-n-c acceleration-z 1", "sim.bolt_nodes.velocity(az=1)"),
    ("pcdc bolt-node boundary b-n-f-b-c force-z table 'v'", "sim.bolt_nodes.force(fz='v')"),
    ("pcdc node boundary mech-vel-b-c acceleration-z 1", "sim.nodes.velocity(az=1)"),
    ("pcdc node initial velocity-z 1", "sim.nodes.initial_velocity(vz=1)"),
    ("pcdc node initial force-z 1", "sim.nodes.force(fz=1)"),
    ("pcdc node boundary mech-f-b-c force-z 1 range z 0 1", "sim.nodes.force(fz=1, where='z 0 1')"),
    ("pcdc node boundary mech-m-b-c type 3 (0,1,1)", "sim.nodes.move(3, (0, 1, 1))"),
    ("pcdc node initial velocity (1,2,3)", "sim.nodes.initial_velocity((1, 2, 3))"),
    ("pcdc element-face boundary m-s-b-c stress-zz -1 range boundary", "sim.faces.stress(zz=-1, where='boundary')"),
    ("pcdc geometry transform 'l' rotate 30 axis (1,0,0)", "sim.geometry.transform('l', rotate=30, axis=(1, 0, 0))"),
    ("pcdc element-face boundary m-s-b-c xy 1 stress-xz table 'v' yz 2", "sim.faces.stress(xy=1, xz='v', yz=2)"),
    ("pcdc element initial stress-xz 1 stress-yz 2 gradient (0,0,1)",
     "sim.elements.initial_stress(xz=1, yz=2, gradient={'yz': (0, 0, 1)})"),
    ("pcdc element c-model mech-bur property density 2500 bulk 2e9 m-s 1e9 k-s-zz 0 k-s-xz 1e-5 k-s-yz 2e-5",
     "sim.elements.model('mech-bur', density=2500, bulk=2e9, maxwell_shear=1e9, kelvin_strain_zz=0, "
     "kelvin_strain_xz=1e-5, kelvin_strain_yz=2e-5)"),
    ("pcdc element c-model mech-m-c property density 25 young 1e9 p-r 0.2 tensile 0 coh table 'c' over plastic-strain",
     "sim.elements.model('mech-m-c', density=25, young=1e9, poisson_ratio=0.2, tensile=0, "
     "cohesion=sim.tables.over('c', 'plastic-strain'))"),
    ("pcdc history create 'h' node nearest (0,0,1) value displacement-z",
     "sim.histories.create('h', 'node', 'displacement-z', nearest=(0, 0, 1))"),
    ("pcdc output image 'cut' field 'displacement' eye '-y' section 'y=12.5'",
     "sim.output.image('cut', field='displacement', eye='-y', section='y=12.5')"),
]  # fmt: skip
"""In three dimensions."""


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


@each(("line", "call"), SAME + IN_SPACE)
def test_a_method_is_the_command(bench: Bench, tmp_path: Path, monkeypatch: Any, line: str, call: str) -> None:
    recorders = Recorder(), Recorder()
    for module in (bindings, execute, api, simulation):
        monkeypatch.setattr(module, "fdem", recorders[0])
    bench.project.dim = 3 if (line, call) in IN_SPACE else 2
    bench(line + "\n")
    for module in (bindings, execute, api, simulation):
        monkeypatch.setattr(module, "fdem", recorders[1])
    monkeypatch.setattr(Simulation, "_kind", lambda self, path: checkpoint.BLOCKS)
    monkeypatch.setattr(Simulation, "_existing", lambda self, file: str(file))
    carry_out(program(bench), call)
    assert recorders[0].calls == recorders[1].calls != []


def test_every_command_has_a_method() -> None:
    """SAME has every command that scripts have, with each of its options and models."""
    said: dict[str, set[str]] = {}
    for line, call in SAME + IN_SPACE:
        bench = Bench(Path())
        bench.project.dim = 3 if (line, call) in IN_SPACE else 2
        statement = bench.interpreter.read(line, "a.sc").statements[0]
        names = {name for name in statement.arguments if name not in ("model", "properties")}
        if "model" in statement.arguments:
            names |= {statement.arguments["model"], *statement.arguments["properties"]}
        said.setdefault(statement.command.name, set()).update(names)
    for command in PCDC.commands:
        if command.idle or command.refused:
            continue
        assert command.name in said, command.name
        of_models = {
            "element property",
            "element-face property",
            "face-joint property",
        }  # any property goes the same way
        options = () if command.name in of_models else command.options
        wanted = {option.name for option in options}
        for model in command.models:
            wanted |= {model.keyword.name}
            if model.of is None:  # those of a law go the same way, whatever their names
                wanted |= {option.name for option in model.options if {*option.dims} & {*command.dims} & {*model.dims}}
        assert wanted - said[command.name] <= NOT_IN_PYTHON.get(command.name, set()), command.name


NOT_IN_PYTHON: dict[str, set[str]] = {"model option": {"creep", "ecda"}}
"""`sim.creep` says the one, and the other is on."""


def test_every_query(bench: Bench) -> None:
    """What the object `pcdc` of a script answers, a program answers."""
    sim = program(bench)
    sim.mesh.structured((0, 0), (4, 2), (4, 2), diagonal="right")
    sim.nodes.group("top", "bc", where="y 2 2")
    sim.histories.create("v", "node", "velocity-y", id=3, every=10)
    sim.step(50)
    bench("a = pcdc.numbers('node', group='top', set='bc')\n"
          "b = pcdc.total('node', 'reaction-y', group='top', set='bc')\n"
          "c = pcdc.values('element', 'stress-xx', x=(0, 1))\nd = (pcdc.time, pcdc.cycle, pcdc.ratio, pcdc.solved)\n"
          "e = pcdc.history('v')\n")  # fmt: skip
    assert sim.nodes.numbers("group 'top' set 'bc'").tolist() == bench["a"].tolist() == [10, 11, 12, 13, 14]
    assert sim.nodes.total("reaction-y", where=g.InGroup("top", "bc")) == bench["b"] == 10.0
    assert np.array_equal(sim.elements.values("stress_xx", "x 0 1"), bench["c"]) and len(bench["c"]) == 4
    assert (sim.block_time, sim.block_steps, sim.ratio, sim.solved) == bench["d"] == (0.5, 50, 1 / 50, {})
    assert (sim.time, sim.steps) == (0.5, 50)
    assert np.array_equal(sim.histories["v"], bench["e"]) and len(bench["e"]) == 5
    assert len(sim.elements["stress-xx"]) == 16
    sim.solve(cycles=3)
    assert sim.solved["reason"] == "cycles" and sim.solved["steps"] == 3


def test_a_property_for_each_object(bench: Bench) -> None:
    sim = program(bench)
    sim.mesh.structured((0, 0), (2, 1), (2, 1))
    young = np.linspace(1e9, 4e9, 4)
    sim.elements.model("mech-iso-elastic", density=2500, young=young, poisson_ratio=0.2)
    (((_, _, given), _),) = bench.blocks.told("element_model")
    assert given["young"].tolist() == young.tolist() and given["poisson_ratio"] == 0.2
    for some in (young, young[:1]):
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # of arrays that are compared with something else
            sim.elements.property(young=some)
        (*_, ((_, given), _)) = bench.blocks.told("element_property")
        assert given["young"].tolist() == some.tolist()


WRONG = {
    "no such property": ("sim.elements.model('mech-iso-elastic', density=1, yuong=3, poisson_ratio=0.2)",
                         "elements.model: model mechanical-iso-elastic has no yuong; it has density, young"),
    "property of another model": ("sim.joints.property(young=3)", "joints.property: face-joint property has no young"),
    "no such model": ("sim.elements.model('elastic', density=1)", "elements.model: there is no model 'elastic'"),
    "model that is no text": ("sim.elements.model(3)", "elements.model: expected the name of a model, got 3"),
    "incomplete model": ("sim.elements.model('mech-iso-elastic', density=1, young=3)",
                         "needs young and poisson_ratio or shear and bulk"),
    "missing property": ("sim.elements.model('mech-iso-elastic', young=3, poisson_ratio=0.2)", "needs density"),
    "word for a number": ("sim.elements.property(young='stiff')", "young: expected a number above 0, got 'stiff'"),
    "value out of range": ("sim.elements.property(poisson_ratio=0.5)", "poisson_ratio: expected a number"),
    "not finite": ("sim.elements.property(young=float('inf'))", "young: expected a number above 0, got inf"),
    "one of an array": ("sim.elements.property(young=np.array([1.0, -1.0]))", "young: expected a number above 0, got"),
    "array of arrays": ("sim.elements.property(young=np.ones((2, 2)))", "young: expected a number above 0, got array"),
    "truth value for a number": ("sim.step(True)", "step: steps: expected a whole number, not negative, got True"),
    "part of a step": ("sim.step(2.5)", "step: steps: expected a whole number"),
    "negative steps": ("sim.step(-1)", "step: steps: expected a whole number, not negative, got -1"),
    "word for a switch": ("sim.option(dynamic='perhaps')", "option: dynamic: expected True or False, got 'perhaps'"),
    "no switch at all": ("sim.option()", "option: needs at least one of dynamic, collision"),
    "unknown switch": ("sim.option(damping=True)", "option: there is no argument 'damping'; available: dynamic,"),
    "unknown word": ("sim.mesh.structured((0, 0), (1, 1), (1, 1), diagnal='both')", "mesh.structured: .*'diagnal'"),
    "number for a flag": ("sim.mesh.intersect('l', follow=1)", "follow: expected True or False, got 1"),
    "cells as one number": ("sim.mesh.structured((0, 0), (1, 1), 4)", "cells: expected a list of values, got 4"),
    "three cells": ("sim.mesh.structured((0, 0), (1, 1), (4, 4, 4))", "cells: expected 2 values"),
    "point in space": ("sim.geometry.circle((0, 0, 0), 1, 'l')", r"centre: expected a vector \(x,y\), got \(0, 0, 0\)"),
    "text for a list": ("sim.mesh.create('o', 1.0, hole='abc')", "hole: expected a list of values, got 'abc'"),
    "too much to refine": ("sim.mesh.create('o', 1.0, refine_layer=[('h', 1, 2, 3)])", "expected size, distance in"),
    "size left out": ("sim.mesh.create('o', 1.0, refine_layer=['h'])", "mesh.create: refine_layer needs size"),
    "no points": ("sim.geometry.polygon([], 'l')", r"points: expected vectors \(x,y\), got none"),
    "set without groups": ("sim.mesh.glue(set='d')", "mesh.glue: set needs between"),
    "two densities": ("sim.geometry.fractures('s', 'o', orientation=('fixed', 1), length=('fixed', 1), p10=1, p20=1, "
                      "seed=1)", "fractures need one density"),
    "two distributions": ("sim.fields.create('f', seed=1, normal=(1, 1), weibull=(1, 1))", "one distribution"),
    "covariance of nothing": ("sim.fields.create('f', seed=1, normal=(1, 1), covariance='gaussian')",
                              "covariance needs correlation"),
    "no axis": ("sim.tables.over('E', 'time')",
                "tables.over: axis: expected 'x', 'y', 'z', 'plastic-strain', 'temperature', 'moisture', got 'time'"),
    "nothing that softens": ("sim.elements.property(young=sim.tables.over('E', 'plastic-strain'))",
                             "young cannot be a table over plastic-strain"),
    "unsorted table": ("sim.tables.create('v', [(1, 0), (0, 0)])", "tables.create: table 'v': times must ascend"),
    "no such table": ("sim.nodes.velocity(vx='v', where='id 0')", "nodes.velocity: there is no table 'v'"),
    "gradient of nothing": ("sim.elements.initial_stress(xx=1, gradient={'yy': (0, 1)})", "there is no stress 'yy'"),
    "nothing to do": ("sim.nodes.force()", "nodes.force: needs at least one of force_x, force_y"),
    "both at once": ("sim.nodes.velocity(vx=1, ax=1)", "velocity-x and acceleration-x cannot be combined"),
    "freedom in space": ("sim.nodes.move(3)", "nodes.move: type: expected 0 free, 1 fixed or 2 along a vector"),
    "no vector": ("sim.nodes.move(2)", "type 2 needs the vector"),
    "two ways to choose": ("sim.histories.create('h', 'node', 'velocity-x', id=1, nearest=(0, 0))",
                           "a history needs one of id, nearest and range"),
    "no such how": ("sim.histories.create('h', 'node', 'velocity-x', how='median')", "how: expected one of sum, mean"),
    "range without how": ("sim.histories.create('h', 'node', 'velocity-x', where='id 0 1')", "needs sum, mean, mini"),
    "no such value": ("sim.histories.create('h', 'node', 'speed', id=1)",
                      "value: expected one of displacement, velocity, position-x"),
    "value of others": ("sim.histories.create('h', 'node', 'stress-xx', id=1)", "a history of node can follow"),
    "no such object": ("sim.histories.create('h', 'nodes', 'velocity-x', id=1)", "object: expected one of node"),
    "no such history": ("sim.histories['load']", r"histories\[...\]: there is no history 'load'"),
    "both of solve": ("sim.solve(elastic=True, time=1.0, cycles=2)", "solve: elastic accepts time or cycles"),
    "creep without its step": ("sim.creep(change=0.1)", "creep: change needs dt"),
    "two time steps": ("sim.time_step(value=1e-6, mass_scaling=1e-6)", "value and mass-scaling cannot be combined"),
    "curve of nothing": ("sim.charts.add('c')", "charts.add: a curve has either y"),
    "figure of no kind": ("sim.charts.export('c', 'c.txt')", "a figure is a file"),
    "range of no objects": ("sim.output.image('f', where='id 0')", "range needs object, one of elements, joints"),
    "looks of nothing": ("sim.output.image('f', log=True)", "log requires field or object"),
    "no such colours": ("sim.output.image('f', colours='jet')", "colours: expected one of viridis"),
    "frames every and off": ("sim.output.vtk('f', every=1, off=True)", "every and off cannot be combined"),
    "wrong RANGE": ("sim.nodes.group('a', where='z 0 1')", "a range in z needs a model in three dimensions"),
    "RANGE of others": ("sim.elements.group('a', where='boundary')", "where 'boundary': .*read 'boundary'"),
    "RANGE the wrong way": ("sim.nodes.group('a', where='x 1 0')", "where 'x 1 0': .*the first is above the second"),
    "empty RANGE": ("sim.nodes.group('a', where='')", "where ''"),
    "RANGE of two lines": ("sim.nodes.group('a', where='id 0\\npcdc model new')", "expected one line"),
    "RANGE with brackets": ("sim.nodes.group('a', where='id [n]')", "use an f-string in Python"),
    "no RANGE at all": ("sim.nodes.group('a', where=3.0)", "where: expected the text of a RANGE or terms of it, got"),
    "list of no terms": ("sim.nodes.group('a', where=('x', 0, 1))", "where: expected the text of a RANGE or terms"),
    "no terms": ("sim.nodes.group('a', where=())", r"where: expected the text of a RANGE or terms of it, got \(\)"),
    "group that is not there": ("sim.nodes.group('a', where=g.InGroup('b'))", "there is no set 'default' of nodes"),
    "nothing chosen": ("sim.nodes.group('a', where='x 9 10')", "nodes.group: the range selects no node"),
    "quantity that is no text": ("sim.elements[3]", "elements.values: expected the name of a quantity, got 3"),
    "cycle without particles": ("sim.cycle(10)", "cycle: no particles: step blocks with step and solve"),
    "budget of particles": ("sim.energy()", "energy: there are no particles; energies is the budget of blocks"),
    "missing file": ("sim.restore('none.sav')", "restore: there is no file"),
}  # fmt: skip


@each("case", WRONG)
def test_a_mistake_is_named_with_its_line(bench: Bench, case: str) -> None:
    text, expected = WRONG[case]
    sim = program(bench)
    sim.mesh.structured((0, 0), (4, 2), (4, 2))
    with pytest.raises(ScriptError, match=expected) as caught:
        carry_out(sim, text)
    assert (caught.value.file, caught.value.line) == ("study.py", 1)


# ---- whole programs --------------------------------------------------------------------------------------------------

SCRIPT = """\
pcdc model new
pcdc mesh structured (0,0) (0.04,0.01) cells 12 3 diagonal alternate group 'bar' set 'domain'
pcdc model option energy on
pcdc field create 'strength' weibull 2.2e6 8 seed 5
pcdc element c-model mech-iso-e property den 2700 y 30e9 p-r 0.25 d-f 0.1
pcdc face-joint c-model c-i-c-i property f 30 c 20e6 t-s field 'strength' gf1 1 gf2 10
pcdc node group 'left' set 'bc' range geometry 'left'
pcdc node group 'right' set 'bc' range geometry 'right'
pcdc table create 'pull' values (0,0) (2e-6,0.15)
pcdc node boundary mech-vel-b-c velocity-x 0 range group 'left' set 'bc'
pcdc node boundary mech-vel-b-c velocity-x table 'pull' range group 'right' set 'bc'
pcdc history create 'load' node value reaction-x sum every 5 range group 'right' set 'bc'
pcdc history create 'way' node value displacement-x mean every 5 range group 'right' set 'bc'
pcdc history create 'broken' model value broken-joints every 5
pcdc history create 'error' model value energy-error every 50
pcdc output vtk 'bar' every 100
pcdc model solve time 2e-5
pcdc model save 'half.sav'
pcdc model step 150
pcdc model save 'end.sav'
pcdc chart create 'pull' x-label 'displacement [[um]]' y-label 'stress [[MPa]]'
pcdc chart add 'pull' x 'way' scale-x 1e6 y 'load' scale-y 1e-4 label 'model'
pcdc chart export 'pull' 'pull.png'
pcdc history export 'all.csv'
"""

PROGRAM = """\
import sys
import hpcdem

sim = hpcdem.Simulation()
sim.start()
sim.mesh.structured((0, 0), (0.04, 0.01), cells=(12, 3), diagonal="alternate", group="bar", set="domain")
sim.option(energy=True)
sim.fields.create("strength", weibull=(2.2e6, 8), seed=5)
sim.elements.model("mech-iso-elastic", density=2700, young=30e9, poisson_ratio=0.25, damp_factor=0.1)
sim.joints.model("c-i-c-i", friction=30, cohesion=20e6, tensile_strength=sim.fields.drawn("strength"), gf1=1, gf2=10)
for end in ("left", "right"):
    sim.nodes.group(end, "bc", where=f"geometry '{end}'")
sim.tables.create("pull", [(0, 0), (2e-6, 0.15)])
sim.nodes.velocity(vx=0, where="group 'left' set 'bc'")
sim.nodes.velocity(vx="pull", where="group 'right' set 'bc'")
ends = "group 'right' set 'bc'"
sim.histories.create("load", "node", "reaction-x", how="sum", every=5, where=ends)
sim.histories.create("way", "node", "displacement-x", how="mean", every=5, where=ends)
sim.histories.create("broken", "model", "broken-joints", every=5)
sim.histories.create("error", "model", "energy-error", every=50)
sim.output.vtk("bar", every=100)
sim.solve(time=2e-5)
sim.save("half.sav")
if "again" in sys.argv:
    sim.step(20)
    sim.restore("half.sav")
sim.step(150)
sim.save("end.sav")
sim.charts.create("pull", x_label="displacement [um]", y_label="stress [MPa]")
sim.charts.add("pull", x="way", scale_x=1e6, y="load", scale_y=1e-4, label="model")
sim.charts.export("pull", "pull.png")
sim.histories.export("all.csv")
assert sim.histories["broken"][-1, 2] > 0 and sim.steps == sim.block_steps
assert sim.histories["load"][-1, 0] == sim.steps // 5 * 5
assert sim.solved["reason"] == "time" and abs(sim.energies["relative"]) < 0.02
assert sim.nodes.values("velocity-x", where="id 12")[0] == 0.15
"""


@pytest.fixture(scope="module")
def script(resident: Resident, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the run of the PCDC script on one rank."""
    folder = tmp_path_factory.mktemp("pcdc")
    (folder / "model.sc").write_text(SCRIPT)
    done = resident(1, "model.sc", cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def different(one: Path, other: Path, names: list[str]) -> list[str]:
    """Files that are not the same, of checkpoints but for the journal of the script."""
    found = []
    for name in names:
        a, b = one / name, other / name
        if a.suffix in (".vtkhdf", ".sav"):
            left, right = contents(a), contents(b)
            keys = {key for key in left if key not in right or left[key].tobytes() != right[key].tobytes()}
            found += [name] * (
                not keys <= ({"@state", "@crc"} if a.suffix == ".sav" else set()) or left.keys() != right.keys()
            )
        elif name != f"data/{RECORD}" and a.read_bytes() != b.read_bytes():
            found.append(name)
    return found


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("ranks", "how", "word"),
    [pytest.param(1, "hpcdem", "", marks=pytest.mark.slow), (2, "hpcdem", "again"),
     pytest.param(2, "python", "", marks=pytest.mark.slow),
     pytest.param(4, "hpcdem", "again", marks=pytest.mark.slow)],
)  # fmt: skip
def test_python_says_what_the_script_says(
    script: Path, launch: Launcher, resident: Resident, tmp_path: Path, ranks: int, how: str, word: str
) -> None:
    (tmp_path / "model.py").write_text(PROGRAM)
    words = ("model.py", *(("--", word) if word and how == "hpcdem" else (word,) if word else ()))
    done = (resident if how == "hpcdem" else launch.python)(ranks, *words, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    names = sorted(
        path.relative_to(script).as_posix() for path in [*script.glob("*.sav"), *(script / "data").iterdir()]
    )
    assert {"end.sav", "data/history_load.csv", "data/all.csv", "data/pull.csv", "data/cracks.csv"} <= set(names)
    assert sum(name.endswith(".vtkhdf") for name in names) > 1
    assert sorted(p.name for p in (tmp_path / "data").iterdir()) == sorted(p.name for p in (script / "data").iterdir())
    assert different(script, tmp_path, names) == []
    line = PROGRAM.splitlines().index("sim.solve(time=2e-5)") + 1
    assert (
        f"line {line}: solve time 2e-05" in done.stdout and "energy budget" in done.stdout and "figure: " in done.stdout
    )
    assert "element-steps/s" in done.stdout


# ---- with particles --------------------------------------------------------------------------------------------------

BOTH = """\
import os
import signal
import sys
import hpcdem

def build():
    sim.mesh.structured((0, 0), (1.2, 0.6), (6, 3))
    sim.elements.model("mech-iso-elastic", density=2700, young=1e9, poisson_ratio=0.25, friction=30)
    sim.nodes.move(1, where="y 0 0")
    sim.gravity((0, -9.81))
    sim.histories.create("top", "node", "velocity-y", nearest=(0.6, 0.6), every=20)
    sim.set(gravity=(0.0, -9.81), print=100)
    sim.ball(0.5, 0.6995, 0.1)
    sim.ball(0.5, 0.8998, 0.1)
    sim.prop(density=2000.0, kn=1e7, ks=1e7, fric=0.5, yv=-1.0, xv=0.3)
    sim.couple(friction=0.4, dt=5e-6)

sim = hpcdem.Simulation()
seen = []
sim.every(50, lambda s: seen.append(s.steps))
if "stop" in sys.argv:
    sim.every(130, lambda s: s.steps == 130 and os.kill(os.getpid(), signal.SIGTERM))
if not sim.resume():
    build()
    sim.step(300)
assert sim.coupling is not None and seen[-1] == 300
both = sim.coupling
values = [*sim.gather("x"), *sim.gather("y"), *sim.gather("spin"), *both.contacts()["fs"], *both.force()]
values += [*sim.nodes["position-y"], both.energies()["lost"], sim.histories["top"][-1, 2]]
assert len(both.contacts()["id"]) and sim.steps == sim.block_steps == 300
open(f"end_{sim.rank}.txt", "w").write(" ".join(float(v).hex() for v in values))
sim.save("both.sav")
"""

BOTH_AS_SCRIPT = """\
import hpcdem
pcdc mesh structured (0,0) (1.2,0.6) cells 6 3
pcdc element c-model mech-iso-e property density 2700 young 1e9 poisson-ratio 0.25 friction 30
pcdc node boundary mech-m-b-c type 1 range y 0 0
pcdc model gravity (0,-9.81)
sim = hpcdem.Simulation(outdir='data/particles')
sim.set(gravity=(0.0, -9.81), print=100)
sim.ball(0.5, 0.6995, 0.1)
sim.ball(0.5, 0.8998, 0.1)
sim.prop(density=2000.0, kn=1e7, ks=1e7, fric=0.5, yv=-1.0, xv=0.3)
pcdc history create 'top' node value velocity-y nearest (0.6,0.6) every 20
both = hpcdem.couple(sim, friction=0.4, dt=5e-6)
pcdc model step 300
values = [*sim.gather("x"), *sim.gather("y"), *sim.gather("spin"), *both.contacts()["fs"], *both.force()]
values += [*pcdc.values('node', 'position-y'), both.energies()["lost"], pcdc.history('top')[-1, 2]]
open("end_script.txt", "w").write(" ".join(float(v).hex() for v in values))
"""


@pytest.mark.mpi
def test_particles_and_blocks_in_one_program(resident: Resident, tmp_path: Path) -> None:
    """The same bits as the script, on two ranks, and when it was stopped and taken up."""
    (tmp_path / "script.sc").write_text(BOTH_AS_SCRIPT)
    done = resident(1, "script.sc", "--no-figure", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    expected = (tmp_path / "end_script.txt").read_text()
    frames = {path.name for path in (tmp_path / "data" / "particles").glob("*.vtkhdf")}
    for name, ranks in (("whole", 1), ("cut", 1)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "study.py").write_text(BOTH)
        words = ("--", "stop") if name == "cut" else ()
        done = resident(ranks, "study.py", "--no-figure", *words, cwd=tmp_path / name)
        assert done.returncode == (85 if words else 0), done.stdout + done.stderr
    assert "resume with Simulation.resume()" in done.stderr
    done = resident(2, "study.py", "--no-figure", cwd=tmp_path / "cut")
    assert done.returncode == 0, done.stdout + done.stderr
    ends = [path.read_text() for name in ("whole", "cut") for path in (tmp_path / name).glob("end_*.txt")]
    assert ends == [expected] * 3
    for name in ("whole", "cut"):
        assert {path.name for path in (tmp_path / name / "data" / "particles").glob("*.vtkhdf")} >= frames
        assert (tmp_path / name / "data" / "history_top.csv").read_bytes() == (
            tmp_path / "data" / "history_top.csv").read_bytes()  # fmt: skip


STOPPED = """\
import os
import signal
import sys
import threading
import hpcdem

sim = hpcdem.Simulation()
if not sim.resume():
    sim.mesh.structured((0, 0), (1, 1), (4, 4), group="rock")
    sim.elements.model("mech-iso-elastic", density=2700, young=1e9, poisson_ratio=0.25, damp_factor=0.2)
    sim.nodes.move(1, where="y 0 0")
    sim.nodes.force(fx=1e4, where="y 1 1")
    sim.histories.create("top", "node", "displacement-x", nearest=(1, 1), every=100)
    if "stop" in sys.argv:
        threading.Timer(0.1, lambda: os.kill(os.getpid(), signal.SIGTERM)).start()
    sim.solve(ratio=1e-30, cycles=STEPS)
assert sim.solved["reason"] == "cycles" and sim.steps == STEPS
open(f"end_{sim.rank}.txt", "w").write(" ".join(float(v).hex() for v in sim.nodes["position-x"]))
"""


@pytest.mark.mpi
def test_stopped_in_the_middle_and_taken_up(resident: Resident, tmp_path: Path) -> None:
    for name in ("whole", "cut"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "study.py").write_text(STOPPED.replace("STEPS", "25000"))
    done = resident(1, "study.py", "--no-figure", cwd=tmp_path / "whole")
    assert done.returncode == 0, done.stdout + done.stderr
    cut = resident(1, "study.py", "--no-figure", "--", "stop", cwd=tmp_path / "cut")
    assert cut.returncode == 85 and "resume with Simulation.resume()" in cut.stderr, cut.stdout + cut.stderr
    rest = resident(2, "study.py", "--no-figure", cwd=tmp_path / "cut")
    assert rest.returncode == 0 and "resuming from" in rest.stdout, rest.stdout + rest.stderr
    ends = {name: [file.read_text() for file in (tmp_path / name).glob("end_*.txt")] for name in ("whole", "cut")}
    assert ends["cut"] == ends["whole"] * 2
    assert (tmp_path / "cut/data/history_top.csv").read_bytes() == (
        tmp_path / "whole/data/history_top.csv"
    ).read_bytes()


HEAD = """\
import hpcdem
sim = hpcdem.Simulation()
sim.mesh.structured((0, 0), (1, 1), (2, 2))
sim.elements.model("mech-iso-elastic", density=2700, young=1e9, poisson_ratio=0.25)
"""
REFUSED = {
    "two states": ("sim.ball(5.0, 5.0, 1.0); sim.save('a.sav')", 2, "study.py:5: save: particles and blocks that are"),
    "functions that nobody calls": ("sim.every(5, print); sim.step(3)", 2, "study.py:5: step: functions of every"),
    "no blocks to couple": ("hpcdem.Simulation('b').couple()", 2, "study.py:5: couple: no blocks yet"),
    "checkpoint of both": ("sim.ball(0.5, 2.0, 0.1); sim.prop(density=2e3, kn=1e6, ks=1e6); sim.couple(); "
                           "sim.save('a.sav'); sim.coupling.end(); sim.restore('a.sav')", 2,
                           "call couple\\(\\) first"),
    "no equilibrium": ("sim.option(dynamic=False); sim.nodes.force(fx=1e6); sim.solve(limit=100)", 3,
                       "study.py:5: solve: no equilibrium"),
    "start of coupled ones": ("sim.ball(0.5, 2.0, 0.1); sim.prop(density=2e3, kn=1e6, ks=1e6); sim.couple(); "
                              "sim.start()",
                              2, "study.py:5: start: start would replace"),
    "step in a function": ("sim.ball(0.5, 2.0, 0.1); sim.prop(density=2e3, kn=1e6, ks=1e6); sim.couple()\n"
                           "sim.every(5, lambda s: s.step(1)); sim.step(10)", 2,
                           "study.py:6: step: model step 1 cannot be used"),
    "file on a full disk": ("sim.charts.create('c'); sim.charts.add('c', values=[(0, 0)]); "
                            "sim.charts.export('c', '/proc/none/c.png')", 1, "study.py:5: charts.export: .*none"),
    "kind of run": ("", 2, "--resume is for ZDEM and PCDC scripts"),
    "fingerprints": ("", 2, "study.py:3: mesh.structured: --check-reproducible is for models of particles"),
}  # fmt: skip


@pytest.mark.mpi
@each("case", REFUSED)
def test_what_is_refused_in_a_run(resident: Resident, tmp_path: Path, case: str) -> None:
    text, code, expected = REFUSED[case]
    (tmp_path / "study.py").write_text(HEAD + text + "\n")
    options = {"kind of run": ["--resume"], "fingerprints": ["--check-reproducible", "5"]}.get(case, [])
    done = resident(1, "study.py", "--no-figure", *options, cwd=tmp_path)
    assert done.returncode == code and re.search(expected, done.stderr), done.stdout + done.stderr
    assert "Traceback" not in done.stderr


QUIET = """\
import hpcdem
with hpcdem.Simulation("a", log=False) as sim:
    sim.mesh.structured((0, 0), (1, 1), (2, 2))
    sim.elements.model("mech-iso-elastic", density=2700, young=1e9, poisson_ratio=0.25)
    sim.histories.create("t", "model", "time", every=2)
    sim.step(4)
    assert sim.outdir.name == "a" and sim.time > 0.0 and sim.dt > 0.0
with hpcdem.Simulation("b") as sand:
    sand.ball(0.5, 2.0, 0.1)
    sand.prop(density=2e3, kn=1e6, ks=1e6)
    sand.set(dt=1e-5)
    sand.cycle(3)
    sand.mesh.structured((0, 0), (1, 1), (2, 2))
    sand.elements.model("mech-iso-elastic", density=2700, young=1e9, poisson_ratio=0.25)
    sand.histories.create("t", "model", "time", every=2)
    sand.step(4)
    assert sand.steps == 3 and sand.block_steps == 4 and sand.outdir.name == "b"
    sand.couple()
    sand.step(2)
    assert sand.steps == 5 and sand.block_steps == 6 and sand.coupling.dt == sand.dt
    sand.coupling.end()
    sand.start()
    assert sand.count == sand.steps == sand.block_steps == 0
"""


def test_several_models_and_their_folders(resident: Resident, tmp_path: Path) -> None:
    (tmp_path / "study.py").write_text(QUIET)
    done = resident(1, "study.py", "--no-figure", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    first = done.stdout.partition("mesh:")[0]
    assert "step 4" not in first and done.stdout.count("mesh: ") == 1  # the first one is quiet
    assert (tmp_path / "a" / "history_t.csv").read_text().count("\n") == 3
    assert (tmp_path / "b" / "blocks" / "history_t.csv").read_text().count("\n") == 4
    assert (tmp_path / "b" / "run.json").exists() and not (tmp_path / "data").exists()


@pytest.mark.slow
def test_the_example_comes_to_the_theory(launch: Launcher, tmp_path: Path) -> None:
    shutil.copy(ROOT / "examples" / "cantilever.py", tmp_path)
    done = launch(1, "cantilever.py", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    rows = re.findall(r"(\d+) elements .* by (\S+) um, theory (\S+) um", done.stdout)
    away = [1.0 - float(end) / float(theory) for _, end, theory in rows]
    assert len(away) == 3 and away[0] > away[1] > away[2] > 0.0 and away[2] < 0.01


def test_the_programs_of_the_documentation_run(resident: Resident, tmp_path: Path) -> None:
    """The section on blocks of docs/python.md, its programs one after the other."""
    text = (ROOT / "docs" / "python.md").read_text().split("## Blocks\n")[1].split("\n## ")[0]
    programs = [part.split("```")[0] for part in text.split("```python\n")[1:]]
    assert len(programs) == 2
    for k, program in enumerate(programs):
        assert "sim.step(20000)" in program
        (tmp_path / f"study{k}.py").write_text(program.replace("sim.step(20000)", "sim.step(50)"))
        done = resident(1, f"study{k}.py", "--no-figure", f"--outdir=data{k}", cwd=tmp_path)
        assert done.returncode == 0, done.stdout + done.stderr


def test_a_script_keeps_its_own_blocks(resident: Resident, tmp_path: Path) -> None:
    (tmp_path / "a.sc").write_text("import hpcdem\nsim = hpcdem.Simulation('b')\npcdc model new\nsim.mesh.quality()\n")
    done = resident(1, "a.sc", "--no-figure", cwd=tmp_path)
    assert done.returncode == 2 and "a.sc:4: mesh.quality: in a PCDC script create the blocks" in done.stderr


@pytest.mark.parametrize("name, old, new", [
    ("Elements", "tell", "report"), ("Faces", "tell", "report"), ("Joints", "tell", "report"),
    ("BlockCommands", "tell_devices", "report_devices"), ("BlockCommands", "tell_time", "report_time"),
])  # fmt: skip
def test_earlier_names_still_work_with_a_warning(monkeypatch, name, old, new) -> None:
    from hpcdem.api import blocks

    of = getattr(blocks, name)
    monkeypatch.setattr(of, new, lambda self, **options: options)
    with pytest.deprecated_call(match=f"{old} of {name} is deprecated: use {new}"):
        assert getattr(object.__new__(of), old)(where="id 1") == {"where": "id 1"}


def test_an_earlier_name_of_an_argument_warns_and_acts(bench: Bench, monkeypatch: Any) -> None:
    """`way` of translate is `vector` now; with both, the earlier one is an unknown argument."""
    sim, recorder = program(bench), Recorder()
    for module in (bindings, execute, api, simulation):
        monkeypatch.setattr(module, "fdem", recorder)
    for of in (sim.geometry, sim.mesh):
        of.translate(vector=(2, 1))
        with pytest.warns(DeprecationWarning, match="way of translate is deprecated: use vector") as warned:
            of.translate(way=(2, 1))
        assert warned[0].filename == __file__
        with pytest.raises(ScriptError, match="there is no argument 'way'"):
            of.translate(way=(2, 1), vector=(2, 1))
    first, second, third, fourth = recorder.calls
    assert first == second != third == fourth
