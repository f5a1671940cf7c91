"""Common base of fields on blocks: heat in elements, fluid in joints, proppant in fluid, moisture of soil."""
