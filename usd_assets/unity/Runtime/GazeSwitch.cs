// SPDX-License-Identifier: Apache-2.0
using System;
using UnityEngine;

namespace StereoCell
{
    /// <summary>How long one target has been gazed at. Plain data.</summary>
    public struct Dwell
    {
        /// <summary>Longest time that a frame counts, s: a stall is no gaze.</summary>
        const float LongestFrame = 0.1f;

        public object Target;
        public float Elapsed;

        /// <summary>A target that has fired is done with until the gaze leaves it.</summary>
        public bool HasFired;

        /// <summary>Go on by a frame; whether it is the one on which the dwell fires. The frame on which a target
        /// is first seen starts its clock and adds nothing to it.</summary>
        public bool Advance(object target, float seconds, float needed)
        {
            if (!ReferenceEquals(target, Target))
            {
                Target = target;
                Elapsed = 0;
                HasFired = false;
                return false;
            }
            if (target == null || HasFired) return false;
            Elapsed += Math.Min(Math.Max(seconds, 0), LongestFrame);
            return HasFired = Elapsed >= needed;
        }

        /// <summary>Share of a ring that is filled, 0 to 1; 0 once it has fired.</summary>
        public float Progress(float needed)
        {
            return Target == null || HasFired ? 0 : Math.Min(1, Elapsed / needed);
        }
    }

    /// <summary>A tile that is gazed at for 1.5 s switches from surfaces to its volume, and back.</summary>
    [DisallowMultipleComponent, AddComponentMenu("StereoCell/Gaze Switch")]
    public sealed class GazeSwitch : MonoBehaviour
    {
        [Tooltip("The viewer's camera; the main one, if there is none here")]
        public Camera viewer;

        [Min(0.1f), Tooltip("Seconds")]
        public float dwell = 1.5f;

        [Tooltip("Farthest tile that is switched, world units")]
        public float reach = 100;

        Dwell state;

        /// <summary>For a reticle: 0 to 1.</summary>
        public float Progress
        {
            get { return state.Progress(dwell); }
        }

        /// <summary>The tile that is looked at; null if there is none.</summary>
        public Tile Target
        {
            get { return state.Target as Tile; }
        }

        /// <summary>Switch the tile that is looked at now, for a button; the dwell is then done with it.</summary>
        public void Press()
        {
            if (Target == null) return;
            state.HasFired = true;
            Target.Switch();
        }

        void Update()
        {
            var eye = viewer != null ? viewer : Camera.main;
            if (eye == null) return;
            var tile = TileAhead(eye.transform);
            if (state.Advance(tile, Time.unscaledDeltaTime, dwell)) tile.Switch();
        }

        Tile TileAhead(Transform eye)
        {
            RaycastHit hit;
            if (!Physics.Raycast(eye.position, eye.forward, out hit, reach, Physics.DefaultRaycastLayers, QueryTriggerInteraction.Collide))
            {
                return null;
            }
            var tile = hit.collider.GetComponentInParent<Tile>();
            return tile == null ? null : tile;  // an object that Unity has destroyed equals null
        }
    }
}
