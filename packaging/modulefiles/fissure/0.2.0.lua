-- Lmod module of Fissure. Copy the folder fissure/ to a folder of MODULEPATH and edit the first two values.
local prefix = "/opt/fissure/0.2.0"
local needed = { "openmpi", "hdf5" }

help([[
Fissure computes how solids deform and break, with peridynamics.
fissure --help lists the commands; fissure slurm hybrid prints a job script.
]])
whatis("Name: Fissure")
whatis("Version: 0.2.0")
whatis("Description: peridynamics for batch jobs, MPI ranks and threads")

for _, name in ipairs(needed) do
    depends_on(name)
end
prepend_path("PATH", pathJoin(prefix, "bin"))
prepend_path("MANPATH", pathJoin(prefix, "share/man"))
