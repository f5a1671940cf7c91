"""What cannot be right is refused, alike on all ranks, with what was found and what was expected."""

from __future__ import annotations

import pytest

from hpcdem.commands.dem import properties, settings
from hpcdem.commands.fdem import coupling, meshes
from hpcdem.commands.fdem.project import Project
from hpcdem.core.errors import CommandError, PhysicsError
from hpcdem.physics.coupling.model import Coupled
from hpcdem.physics.fdem import changes
from hpcdem.physics.fdem import saved_state as blocks_state
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import rectangle
from tests.coupled.support import body, discs, together


def both_of(tmp_path, y=0.71, **options):
    return together(discs([(0.5, y, 0.1)], tmp_path, dt=5e-6), body(rectangle(6, 3, 1.2, 0.6)), **options)


@pytest.mark.parametrize("kind", ["cross", "quad"])
def test_a_disc_inside_an_element(tmp_path, kind):
    both = together(discs([(0.31, 0.33, 0.02)], tmp_path, dt=5e-6), body(rectangle(6, 3, 1.2, 0.6, kind=kind)))
    with pytest.raises(CommandError, match=r"the centre of particle 0 lies inside element \d+"):
        both.advance(1)


def test_a_disc_deeper_than_its_radius_but_outside(tmp_path):
    """The centre counts: an overlap of nearly the radius is a strong spring, not an error."""
    both = both_of(tmp_path, y=0.601)
    both.advance(2)
    assert both.contacts()["overlap"].max() == pytest.approx(0.099, rel=1e-2)


def test_a_disc_that_goes_through_a_face(tmp_path):
    both = both_of(tmp_path)
    properties.prop(both.particles, kn=1e2, yv=-50.0)
    with pytest.raises(PhysicsError, match=r"particle 0, now at .* passed through the surface of an element"):
        both.advance(3000)


def test_time_steps_that_differ(tmp_path):
    blocks = body(rectangle(6, 3, 1.2, 0.6))
    blocks.time_step(value=4e-6)
    with pytest.raises(CommandError, match="SET dt 5e-06 s and model time-step 4e-06 s differ"):
        together(discs([(0.5, 0.8, 0.1)], tmp_path, dt=5e-6), blocks)


def test_a_time_step_that_is_changed_later(tmp_path):
    both = both_of(tmp_path)
    both.advance(5)
    both.blocks.time_step(value=2e-6)
    with pytest.raises(CommandError, match="the time steps differ: 5e-06 s of the particles, 2e-06 s of the"):
        both.advance(1)
    settings.set_option(both.particles, "dt", 2e-6)
    both.settle_time_step()
    both.advance(5)


def test_the_smaller_time_step_is_chosen(tmp_path):
    """Nothing said: soft discs on stiff elements step with the elements, stiff discs with their contacts."""
    steps = {}
    for kn in (1e4, 1e12):
        sim = discs([(0.5, 0.71, 0.1)], tmp_path)
        properties.prop(sim, kn=kn)
        sim.close_model()
        both = Coupled(sim, body(rectangle(6, 3, 1.2, 0.6)))
        steps[kn] = both.settle_time_step()
        alone = both.blocks.local.masses.critical_time_step()
        assert sim.clock.dt == both.blocks.clock.dt == steps[kn] <= alone
        both.advance(1)
    assert steps[1e4] == pytest.approx(alone, rel=1e-3) and steps[1e12] < 0.2 * alone


@pytest.mark.parametrize("change", [{"dynamic": False}, {"auto": True}, {"mass_scaling": 1e-4}])
def test_options_that_do_not_go_together(tmp_path, change):
    both = both_of(tmp_path)
    if "dynamic" in change:
        both.blocks.option(**change)
    else:
        both.blocks.time_step(**change)
        with pytest.raises(CommandError, match="coupled blocks need"):
            both.settle_time_step()
    with pytest.raises(CommandError, match="coupled blocks need"):
        both.advance(1)


def test_numbers_and_owners(tmp_path):
    blocks = body(rectangle(6, 3, 1.2, 0.6))
    sim = discs([(0.5, 0.71, 0.1)], tmp_path, dt=5e-6)
    with pytest.raises(CommandError, match="friction must be a number"):
        Coupled(sim, blocks, friction=-1.0)
    first = Coupled(sim, blocks)
    with pytest.raises(CommandError, match="are coupled already"):
        Coupled(sim, blocks)
    first.release()
    Coupled(sim, blocks)


def test_files_of_another_kind(tmp_path):
    """The three kinds of checkpoints are told apart, and a failed restore leaves both models as they were."""
    from hpcdem.physics.coupling import saved_state
    from hpcdem.physics.dem import saved_state as of_particles

    both = both_of(tmp_path)
    both.advance(5)
    paths = {name: tmp_path / f"{name}.sav" for name in ("both", "discs", "blocks")}
    saved_state.save(both, paths["both"], {"a": 1})
    of_particles.save(both.particles, paths["discs"])
    blocks_state.save(both.blocks, paths["blocks"])
    with pytest.raises(CommandError, match="not one of a model of blocks"):
        blocks_state.restore(both.blocks, paths["both"])
    with pytest.raises(CommandError, match="not one of particles"):
        of_particles.restore(both.particles, paths["both"])
    for name in ("discs", "blocks"):
        with pytest.raises(CommandError, match="not one of particles and blocks together"):
            saved_state.restore(both, paths[name])
    both.advance(5)
    assert (
        saved_state.restore(both, paths["both"]) == {"a": 1}
        and both.blocks.clock.step == both.particles.clock.step == 5
    )


def test_blocks_that_are_replaced(tmp_path):
    """A new mesh, and discs that come and go, between two runs."""
    from hpcdem.commands.dem import particles
    from tests.coupled.support import ROCK

    both = both_of(tmp_path, y=0.699)
    both.advance(20)
    assert len(both.contacts()["id"]) == 1
    particles.ball(both.particles, 1, 0.9, 0.6995, 0.1)
    properties.prop(both.particles, density=2500.0, kn=1e7, ks=5e6)
    both.advance(20)
    assert list(both.contacts()["id"]) == [0, 1]
    particles.delete(both.particles)
    both.advance(2)
    assert not len(both.contacts()["id"]) and both.force_on_blocks() == (0.0, 0.0)
    both.blocks.take_mesh(rectangle(2, 1, 1.2, 0.6))
    changes.element_model(both.blocks, None, "mech_iso_elastic", ROCK)
    both.settle_time_step()
    both.advance(2)


@pytest.mark.parametrize(
    "inside, said",
    [("pcdc model step 1", "model step 1 cannot be used by a function that is called during model step 20"),
     ("s.cycle(1)", "CYC cannot be used by a function"), ("both.end()", "end cannot be used by a function"),
     ("pcdc model new", "model new cannot be used by a function"), ("1 / 0", "ZeroDivisionError: division by zero")],
)  # fmt: skip
def test_what_a_function_must_not_do(resident, tmp_path, inside, said):
    """Called in the middle of a command: an error with the line, on whose way out nothing hangs."""
    (tmp_path / "script.sc").write_text(
        "import hpcdem\n"
        "pcdc mesh structured (0,0) (1,1) cells 2 2\n"
        "pcdc element c-model mech-iso-e property den 2000 y 1e9 p-r 0.2\n"
        "sand = hpcdem.Simulation(outdir='sand')\n"
        "sand.set(disk='on', dt=1e-6)\n"
        "sand.box(-1.0, 3.0, -1.0, 4.0)\n"
        "sand.ball(0.5, 1.5, 0.1)\n"
        "sand.prop(density=2000.0, kn=1e7)\n"
        "both = hpcdem.couple(sand)\n"
        "def act(s):\n"
        f"    {inside}\n"
        "sand.every(5, act)\n"
        "pcdc model step 20\n"
    )
    done = resident(1, "script.sc", "--no-figure", cwd=tmp_path)
    assert done.returncode in (1, 2) and "script.sc" in done.stderr and "11" in done.stderr, done.stderr
    assert said in done.stderr


def test_blocks_in_three_dimensions(tmp_path):
    """Particles are discs of a plane: they are not stepped with tetrahedra."""
    project = Project(Blocks(outdir=tmp_path / "data"), tmp_path, tmp_path / "data")
    project.clear(3)
    meshes.grid(project, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (1, 1, 1))
    with pytest.raises(CommandError, match="discs move in a plane and cannot be coupled to blocks in three"):
        coupling.couple(project, discs([(0.5, 1.5, 0.1)], tmp_path / "sand", dt=5e-6))
    assert project.coupled is None
