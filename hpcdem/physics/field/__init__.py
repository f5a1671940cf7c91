"""What fields on blocks share: heat in elements, fluid in joints, proppant in fluid, moisture of soil."""
