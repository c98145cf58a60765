"""The parameters of the impacts from a session: β, μ, a pile's β, α, γ, and how sure they are."""
