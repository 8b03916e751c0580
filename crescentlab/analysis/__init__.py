"""Analyses of one circuit, each a package whose door is named like its command.

.. code-block:: text

    outcome      numbers a run is summed up in: mean(line.p), amplitude(delivery.p, 433.3 Hz)
    steady       the operating point
    periodic     the periodic steady state
    linear       matrices, modes, frequency responses, impedances
    spectrum     amplitude spectra over whole periods, waterfalls
    sensitivity  derivatives of outcomes by parameters
    doctor       what limits the step, where the energy goes, which line model is too coarse
"""
