"""Studies: many runs of one circuit, over grids, samples and corners.

A study file names a circuit, what varies, how each point is run, and what is measured. The points run side by side in
worker processes, on this machine or on a Dask cluster; every point becomes a row, whatever happens to it.

.. code-block:: text

    study_file     STUDY.yaml -> Study: its sections, checked for shape, with their places
    targets        what quantity a varied setting has in the circuit
    distributions  text -> distributions, ranges and tolerances of a setting
    sampling       what varies -> points
    planning       Study -> Planned: the circuit tried, every name and unit checked before any run
    points         one point -> its outcomes; standing: windows without a run behind them
    worker, pool   processes that run points, killed when they take too long; dask_runner: the same on a cluster
    provenance     hashes of the circuit and of the library, versions
    store          rows on disk: a journal, Parquet parts, the manifest
    conduct        Planned + store -> what is missing, run; the table; run_study: all of it, for command and Python
    tables, pictures (on drawing), progress

    fit_file, fit_problem             FIT.yaml and its data -> a problem; fit_scales: logarithms and bounds
    fit_model, fitting                its residuals and derivatives; the searches
    identifiability, fit_linearity    what cannot be told apart; where standard errors hold
    fit_advice, fit_report, fit_pictures; run_fit: all of it, for Python
"""
