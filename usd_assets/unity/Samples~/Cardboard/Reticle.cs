// SPDX-License-Identifier: Apache-2.0
using UnityEngine;

namespace StereoCell.Samples
{
    /// <summary>A dot in the middle of the view with a ring around it. The ring fills while a tile is looked at, and again
    /// while the tile's voxels are loaded.</summary>
    [RequireComponent(typeof(MeshFilter), typeof(MeshRenderer)), AddComponentMenu("StereoCell/Reticle")]
    public sealed class Reticle : MonoBehaviour
    {
        const int Segments = 48;
        const float DotRadius = 0.12f, Inner = 0.7f, Outer = 1;  // shares of the reticle's radius

        [Tooltip("Gaze switches whose progress the ring shows. If there are none, all of the scene are used.")]
        public GazeSwitch[] gazes = new GazeSwitch[0];

        Mesh mesh;
        int[] triangles;
        int shown = -1;

        /// <summary>Number of the ring's segments that are filled.</summary>
        public int Filled
        {
            get { return shown; }
        }

        void Awake()
        {
            if (gazes.Length == 0) gazes = FindObjectsByType<GazeSwitch>(FindObjectsSortMode.None);
            MakeMesh();
        }

        void OnDestroy()
        {
            Destroy(mesh);
        }

        void LateUpdate()
        {
            float progress = 0;
            foreach (var gaze in gazes)
            {
                if (gaze == null) continue;
                var tile = gaze.Target;
                progress = Mathf.Max(progress, tile != null && tile.IsLoading ? tile.Progress : gaze.Progress);
            }
            Fill(Mathf.RoundToInt(progress * Segments));
        }

        void MakeMesh()
        {
            var vertices = new Vector3[3 * (Segments + 1) + 1];
            triangles = new int[9 * Segments];
            for (var i = 0; i <= Segments; i++)
            {
                var angle = 2 * Mathf.PI * i / Segments;  // clockwise from the top
                var direction = new Vector3(Mathf.Sin(angle), Mathf.Cos(angle), 0);
                vertices[3 * i] = direction * DotRadius;
                vertices[3 * i + 1] = direction * Inner;
                vertices[3 * i + 2] = direction * Outer;
            }
            // The dot's triangles come first, so that the first n triangles are the dot and the filled part of the ring.
            for (var i = 0; i < Segments; i++)
            {
                int dot = 3 * i, ring = 3 * Segments + 6 * i, here = 3 * i, next = 3 * (i + 1);
                triangles[dot] = vertices.Length - 1;
                triangles[dot + 1] = here;
                triangles[dot + 2] = next;
                triangles[ring] = here + 1;
                triangles[ring + 1] = here + 2;
                triangles[ring + 2] = next + 2;
                triangles[ring + 3] = here + 1;
                triangles[ring + 4] = next + 2;
                triangles[ring + 5] = next + 1;
            }
            mesh = new Mesh { name = "reticle", vertices = vertices };
            GetComponent<MeshFilter>().sharedMesh = mesh;
            Fill(0);
        }

        void Fill(int segments)
        {
            if (segments == shown) return;
            shown = segments;
            mesh.SetTriangles(triangles, 0, 3 * Segments + 6 * segments, 0, false);
            mesh.RecalculateBounds();
        }
    }
}
